//! The amplifiers reach their rail before the converter reaches its top.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use crate::setup::Array;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "saturation",
    family: Family::Sensor,
    about: "The column amplifiers cannot reach the converter's reference.",
    equations: &["v' = min(v, V_ref - headroom_mv)"],
    state: "none",
    reference: "output swing to the rail in data sheets of amplifiers, 5 to 200 mV",
    keys: &[Key::number("headroom_mv", "How far below the reference of 3.3 V they end.", 0.0, 3000.0, 50.0)],
    zero: &[("headroom_mv", 0.0)],
    build: |build: &Build| {
        let rail_v = Array::default().reference_v - build.values.number("headroom_mv") * 1e-3;
        Part::Volts(Box::new(move |_, _, volts| volts.iter_mut().for_each(|volts| *volts = volts.min(rail_v))))
    },
};
