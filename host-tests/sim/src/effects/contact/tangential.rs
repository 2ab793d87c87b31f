//! Friction along the surface: the patch gives a little, sticks, and slips.

use super::Grip;
use crate::effects::random::normal_within_3;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "tangential",
    family: Family::Contact,
    about: "Friction along the surface: the patch gives a little, sticks, and slips.",
    equations: &[
        "T = n_per_mm s + damping_n_s_per_mm ds/dt, s the way of the object against the tip since they stick",
        "it slips where T > still N; while it slips T = slipping N, and it sticks again once the motion turns",
        "the patch's centre on the array moves by s",
        "both shares times 1 + spread_percent / 100 g, g normal within 3 deviations, drawn once",
    ],
    state: "stretch of the patch, way slipped (mm), and which way it slips",
    reference: "Coulomb friction behind a spring (Dahl; Mindlin's full stick): silicone on skin-like surfaces 0.5 to 1",
    keys: &[
        Key::number("n_per_mm", "Stiffness of the patch along the surface.", 0.001, 1000.0, 1.0),
        Key::number("damping_n_s_per_mm", "Damping of the patch along the surface.", 0.0, 10.0, 0.001),
        Key::number("still", "Share of the normal force at which it begins to slip.", 0.0, 10.0, 0.8),
        Key::number("slipping", "Share of the normal force while it slips; at most `still` counts.", 0.0, 10.0, 0.7),
        Key::number(
            "spread_percent",
            "Deviation of both shares from finger to finger and seed to seed.",
            0.0,
            30.0,
            0.0,
        ),
        Key::number("drift_mm_per_s", "How fast an object that stands fast is drawn along.", -1000.0, 1000.0, 0.0),
        Key::number("drift_from_s", "From when.", 0.0, 1000000.0, 0.0),
    ],
    zero: &[("drift_mm_per_s", 0.0)],
    build: |build: &Build| {
        let values = build.values;
        let spread = values.number("spread_percent") / 100.0;
        let drawn = 1.0 + spread * normal_within_3(&mut Rng::with_seed(build.seed));
        let grip = Grip {
            n_per_mm: values.number("n_per_mm"),
            n_s_per_mm: values.number("damping_n_s_per_mm"),
            still: drawn * values.number("still"),
            slipping: drawn * values.number("slipping").min(values.number("still")),
            drift_mm_per_s: values.number("drift_mm_per_s"),
            drift_from_s: values.number("drift_from_s"),
        };
        Part::Tangent(Box::new(move || grip))
    },
};
