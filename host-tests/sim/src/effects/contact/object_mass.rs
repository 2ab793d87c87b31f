//! The object can move: it has a mass, and weighs.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "object_mass",
    family: Family::Contact,
    about: "The object can move: it has a mass, and weighs.",
    equations: &[
        "m dX/dt^2 = N_1 - N_2 between the fingers, m dY/dt^2 = T_1 + T_2 - m g + floor, upwards",
        "the floor stops it without a bounce",
    ],
    state: "place and speed of the object along the fingers' motion and upwards",
    reference: "Newton; g = 9.80665 m/s^2",
    keys: &[Key::number("mass_g", "Its mass; 0 stands fast.", 0.0, 10000.0, 20.0)],
    zero: &[("mass_g", 0.0)],
    build: |build: &Build| {
        let kg = build.values.number("mass_g") * 1e-3;
        Part::Body(Box::new(move || kg))
    },
};
