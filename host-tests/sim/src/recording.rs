//! Recordings: MCAP files that Foxglove and PlotJuggler open without a plugin, and that replay to the bit.
//!
//! | topic | schema | when | what |
//! | --- | --- | --- | --- |
//! | `/finger0/scalars` | `fingertip.Scalars` | each `every`-th step | sensed and true values, each a number of its own, the unit in its name |
//! | `/finger0/frame` | `fingertip.Frame` | 100 times a second | the frame's codes, `[slot][column]` |
//! | `/finger0/image` | `foxglove.RawImage` | 100 times a second | the same as a grey picture |
//! | `/finger0/core` | `fingertip.Core` | each step | all that the core was given, byte for byte, and a digest of all that it answered |
//!
//! The scene's text is attached, the controllers' parameters are metadata: a replay needs no other file. A recording of
//! the emulated board holds what is seen of it from outside, a step each millisecond: it cannot be replayed, and says
//! so.

mod check;
mod replay;
mod schemas;
mod write;

pub use check::check;
pub use replay::{Difference, Replay, replay};
pub use schemas::{SCALARS, all as schemas};
pub use write::Recorder;

use crate::watch::Controller;
use fingertip::params::Params;
use serde_json::{Map, Value, json};

/// The metadata record that holds the scene and the controllers.
const SETUP: &str = "fingertip.setup";
/// The metadata record that closes a whole recording.
const END: &str = "fingertip.end";

/// Its entry that says whether a replay is possible.
const WHOLE: &str = "whole";

/// Entries of what closes it: digests of the record that holds the controllers, and of the scene's text.
const OF_SETUP: &str = "setup";
const OF_SCENE: &str = "scene";

fn topic(finger: usize, what: &str) -> String {
    format!("/finger{finger}/{what}")
}

/// A controller as JSON: its parameters by name, its calibration by taxel.
fn controller_json(controller: &Controller) -> Value {
    let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
    let params: Map<String, Value> = names.zip(controller.params.to_array().map(Value::from)).collect();
    json!({ "params": params, "calibration": controller.calibration })
}

/// The inverse; none where something is missing or of another kind.
fn controller_of(value: &Value) -> Option<Controller> {
    let mut values = [0; Params::COUNT];
    for ((name, ..), place) in Params::RANGES.iter().zip(&mut values) {
        *place = value["params"][name].as_i64()?.try_into().ok()?;
    }
    let calibration = serde_json::from_value(value["calibration"].clone()).ok()?;
    Some(Controller { params: Params::from_array(&values), calibration })
}
