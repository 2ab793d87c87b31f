//! Friction that grows with the speed.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "viscous_friction",
    family: Family::Drive,
    about: "Friction that grows with the speed.",
    equations: &["T = -torque_unm_s w"],
    state: "none",
    reference: "grease and eddy currents; a tenth of k_t^2 / R of the reference motor is 1 uNm s",
    keys: &[Key::number("torque_unm_s", "Torque for each rad/s at the motor's shaft.", 0.0, 10000.0, 0.1)],
    zero: &[("torque_unm_s", 0.0)],
    build: |build: &Build| {
        let nm_s = build.values.number("torque_unm_s") * 1e-6;
        Part::Resist(Box::new(move |_, friction| friction.viscous_nm_s += nm_s))
    },
};
