//! The encoder's disc is coarser than what is counted: the count jumps.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "encoder_resolution",
    family: Family::Drive,
    about: "The encoder's disc is coarser than what is counted: the count jumps.",
    equations: &["n = step_counts floor(n_fine / step_counts)"],
    state: "none",
    reference: "an IE2-400 in place of one with 1600 counts a turn: 4",
    keys: &[Key::whole("step_counts", "Counts by which the reading jumps.", 1, 4096, 4)],
    zero: &[("step_counts", 1.0)],
    build: |build: &Build| {
        let step = build.values.whole("step_counts") as i32;
        Part::Encoder(Box::new(move |count| count.div_euclid(step).wrapping_mul(step)))
    },
};
