//! The object yields like a spring behind its surface.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "object_stiffness",
    family: Family::Contact,
    about: "The object yields like a spring behind its surface.",
    equations: &["x = d + yield_mm_per_n F: tip and object in series", "E = E_tip(d) + yield_mm_per_n F^2 / 2"],
    state: "none",
    reference: "two springs in series; a soft ball 0.1 to 2 mm/N",
    keys: &[Key::number("yield_mm_per_n", "How far it yields for each force; 0 is rigid.", 0.0, 1000.0, 0.5)],
    zero: &[("yield_mm_per_n", 0.0)],
    build: |build: &Build| {
        let mm_per_n = build.values.number("yield_mm_per_n");
        Part::Series(Box::new(move || mm_per_n))
    },
};
