//! Friction of motor and gear.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

pub(super) const DRY_FRICTION: Description = Description {
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

pub(super) const STRIBECK: Description = Description {
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

pub(super) const VISCOUS_FRICTION: Description = Description {
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

pub(super) const GEAR_EFFICIENCY: Description = Description {
    name: "gear_efficiency",
    family: Family::Drive,
    about: "The gear takes a share of the torque that goes through it.",
    equations: &[
        "T_f = (1 / efficiency - 1) T, T the tip's load at the shaft; it takes the sign of the motion and holds at rest",
        "pressing, the share efficiency of the torque arrives; pushed back, the motor feels T (2 - 1 / efficiency)",
    ],
    state: "none",
    reference: "docs/runs.md: FAULHABER 14/1 at 43:1, 70 %, github.com/ekrimsk/MGDB",
    keys: &[Key::number(
        "efficiency",
        "Share of the torque that arrives when the motor drives the load.",
        0.1,
        1.0,
        0.7,
    )],
    zero: &[("efficiency", 1.0)],
    build: |build: &Build| {
        let share = 1.0 / build.values.number("efficiency") - 1.0;
        Part::Resist(Box::new(move |_, friction| friction.load_share += share))
    },
};
