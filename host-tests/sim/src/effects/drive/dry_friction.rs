//! Friction of brushes and bearings that does not depend on speed, and sticks.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "dry_friction",
    family: Family::Drive,
    about: "Friction of brushes and bearings that does not depend on speed, and sticks.",
    equations: &["T = -sign(w) torque_mnm while it turns", "at rest it holds any torque up to torque_mnm"],
    state: "none",
    reference: "FAULHABER data sheet 1331 ... SR: 0.12 mNm",
    keys: &[Key::number("torque_mnm", "Friction torque at the motor's shaft.", 0.0, 20.0, 0.12)],
    zero: &[("torque_mnm", 0.0)],
    build: |build: &Build| {
        let torque_nm = build.values.number("torque_mnm") * 1e-3;
        Part::Resist(Box::new(move |_, friction| {
            friction.sliding_nm += torque_nm;
            friction.holding_nm += torque_nm;
        }))
    },
};
