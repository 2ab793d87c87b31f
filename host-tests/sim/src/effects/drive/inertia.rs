//! Inertia of the gear and mass of the finger, beside the rotor's.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "inertia",
    family: Family::Drive,
    about: "Inertia of the gear and mass of the finger, beside the rotor's.",
    equations: &["J = J_rotor + gear_g_cm2 + finger_g (r / n)^2, r / n the tip's way for each angle of the shaft"],
    state: "none",
    reference: "docs/plant.md: 30 g at the tip are 3 % of the rotor's inertia; none is published for the gear",
    keys: &[
        Key::number("gear_g_cm2", "Of the gear, at the motor's shaft.", 0.0, 100.0, 0.05),
        Key::number("finger_g", "Mass that moves with the tip.", 0.0, 1000.0, 30.0),
    ],
    zero: &[("gear_g_cm2", 0.0), ("finger_g", 0.0)],
    build: |build: &Build| {
        let gear_kg_m2 = build.values.number("gear_g_cm2") * 1e-7;
        let finger_kg = build.values.number("finger_g") * 1e-3;
        Part::Inertia(Box::new(move |m_per_rad| gear_kg_m2 + finger_kg * m_per_rad * m_per_rad))
    },
};
