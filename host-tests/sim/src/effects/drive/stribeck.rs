//! Friction that is higher at low speed: what starts moving jumps.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "stribeck",
    family: Family::Drive,
    about: "Friction that is higher at low speed: what starts moving jumps.",
    equations: &[
        "T = -sign(w) torque_mnm / (1 + (w / speed)^2), added to other friction",
        "at rest it holds up to torque_mnm more",
        "the speed is taken at the middle of the step, foreseen from the step before",
    ],
    state: "none",
    reference: "the Lorentzian form after Hess and Soom, J. Tribology 112 (1990); here it comes without an exponential",
    keys: &[
        Key::number("torque_mnm", "What it adds at rest, at the motor's shaft.", 0.0, 20.0, 0.06),
        Key::number("speed_rad_per_s", "Speed at which half of it is left.", 0.01, 10000.0, 5.0),
    ],
    zero: &[("torque_mnm", 0.0)],
    build: |build: &Build| {
        let torque_nm = build.values.number("torque_mnm") * 1e-3;
        let half_rad_per_s = build.values.number("speed_rad_per_s");
        Part::Resist(Box::new(move |speed_rad_per_s, friction| {
            let share = speed_rad_per_s / half_rad_per_s;
            friction.sliding_nm += torque_nm / (1.0 + share * share);
            friction.holding_nm += torque_nm;
        }))
    },
};
