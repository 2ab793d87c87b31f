//! The object breaks under too high a force, and then gives way.

use super::Strength;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use crate::watch::Truth;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "breakable_object",
    family: Family::Contact,
    about: "The object breaks under too high a force, and then gives way.",
    equations: &["once F > force_n: F and its energy fall to the share left of what they were, for good"],
    state: "whether it is broken",
    reference: "a raspberry is crushed by 1 to 2 N",
    keys: &[
        Key::number("force_n", "The force that it bears.", 0.0, 1000000.0, 1.5),
        Key::number("left", "Share of the force that is left after.", 0.001, 1.0, 0.2),
    ],
    zero: &[("force_n", 1000000.0)],
    build: |build: &Build| {
        let (force_n, left) = (build.values.number("force_n"), build.values.number("left"));
        Part::Strength(Box::new(BreakableObject { force_n, left, broken: false }))
    },
};

struct BreakableObject {
    force_n: f64,
    left: f64,
    broken: bool,
}

impl Strength for BreakableObject {
    fn left(&mut self, force_n: f64) -> f64 {
        self.broken |= force_n > self.force_n;
        if self.broken { self.left } else { 1.0 }
    }

    fn tell(&self, truth: &mut Truth) {
        truth.broken |= self.broken;
    }
}
