//! A state as messages for what shows recordings: the topics and the names of the scenes', so that what shows those
//! shows these (`tests/messages.rs`). The numbers are `fingertip.Scalars`, the pressures a grey image.

use crate::state::{SHAPE, Stamp, State};
use crate::{Client, Error};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::shipped::address;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Schema of <https://docs.foxglove.dev/docs/sdk/schemas/raw-image>; recordings of scenes include the same file.
const IMAGE_SCHEMA: &str = include_str!("messages/raw_image.json");
/// Pa for a grey level: that of the scenes, 8 codes at 24 codes for a kPa.
const PA_PER_GREY: i64 = 333;

/// A kind of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The numbers.
    Scalars,
    /// The pressures.
    Image,
}

impl Topic {
    pub fn name(self, id: u8) -> String {
        let kind = match self {
            Self::Scalars => "scalars",
            Self::Image => "image",
        };
        topic(id, kind)
    }

    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Scalars => "fingertip.Scalars",
            Self::Image => "foxglove.RawImage",
        }
    }

    pub fn schema(self) -> Vec<u8> {
        match self {
            Self::Scalars => {
                let number = |about| json!({ "type": "number", "description": about });
                let scalars = scalars(0.0, &State::default());
                let properties = Map::from_iter(scalars.map(|(name, about, _)| (name.to_owned(), number(about))));
                let schema = json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties });
                schema.to_string().into_bytes()
            }
            Self::Image => IMAGE_SCHEMA.into(),
        }
    }

    /// Adds the topic of a controller to a file.
    pub fn add_to<W: Write + Seek>(
        self,
        out: &mut mcap::Writer<W>,
        id: u8,
        device: &BTreeMap<String, String>,
    ) -> mcap::McapResult<u16> {
        let schema = out.add_schema(self.schema_name(), "jsonschema", &self.schema())?;
        out.add_channel(schema, &self.name(id), "json", device)
    }

    /// A state's message, in JSON.
    pub fn message(self, stamp: &Stamp, state: &State) -> Vec<u8> {
        let message = match self {
            Self::Scalars => {
                let named = scalars(stamp.time_s, state).map(|(name, _, value)| (name.to_owned(), value));
                Value::Object(Map::from_iter(named))
            }
            Self::Image => image(stamp.frame_ns, state),
        };
        message.to_string().into_bytes()
    }
}

/// A topic of a controller: as the scenes have it, fingers count from 0 and IDs from 1.
pub fn topic(id: u8, kind: &str) -> String {
    format!("/finger{}/{kind}", id.saturating_sub(1))
}

/// Identity of a controller, for the metadata of a recording and of its channels.
pub fn device(client: &mut Client) -> Result<BTreeMap<String, String>, Error> {
    let (pong, information) = (client.ping()?, client.number(address::MODEL_INFORMATION)?);
    let entries = [
        ("model_number", pong.model.to_string()),
        ("id", pong.id.to_string()),
        ("firmware", format!("{}.{}", pong.firmware / 10, pong.firmware % 10)),
        ("control_table", (information >> 16).to_string()),
        ("tool", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    Ok(entries.map(|(name, value)| (name.to_owned(), value)).into())
}

/// The scene's scalars that a controller knows: name, description and value.
fn scalars(time_s: f64, state: &State) -> [(&'static str, &'static str, Value); 13] {
    let thousandth = |value: i64| json!(value as f64 * 1e-3);
    [
        ("time_s", "The controller's time from the first state", json!(time_s)),
        ("goal_n", "The force asked for", thousandth(state.goal_mn)),
        ("sensed_force_n", "Normal force as the controller senses it", thousandth(state.force_mn)),
        ("indentation_mm", "Indentation of the tip, by the model", thousandth(state.indentation_um)),
        ("travel_mm", "Way of the tip since torque was enabled", thousandth(state.travel_um)),
        ("speed_mm_per_s", "Speed of the tip", thousandth(state.speed_um_per_s)),
        ("duty_percent", "Share of the supply at the motor; positive presses", json!(state.duty_permille as f64 * 0.1)),
        ("centre_x_mm", "Sensed centre of the contact along the columns", thousandth(state.centre_x_um)),
        ("centre_y_mm", "Sensed centre of the contact along the rows", thousandth(state.centre_y_um)),
        (
            "confidence_percent",
            "Confidence that the contact is a tip on a plane",
            json!(state.confidence as f64 / 2.55),
        ),
        ("mode", "Mode, by its number on the bus", json!(state.mode)),
        ("fault", "Fault, by its number on the bus; 0 is none", json!(state.fault)),
        ("limits", "Limits, a bit each as on the bus", json!(state.limits)),
    ]
}

fn image(time_ns: u64, state: &State) -> Value {
    let [rows, columns] = SHAPE;
    let grey = |pa: &i64| (pa / PA_PER_GREY).clamp(0, 255) as u8;
    // The last row on top.
    let data: Vec<u8> = state.pressures_pa.chunks(columns).rev().flatten().map(grey).collect();
    json!({
        "timestamp": { "sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000 },
        "frame_id": "array", "width": columns, "height": rows, "encoding": "mono8", "step": columns,
        "data": BASE64_STANDARD.encode(data),
    })
}
