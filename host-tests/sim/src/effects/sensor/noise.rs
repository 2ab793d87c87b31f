//! Noise of amplifiers and converter.

use super::Row;
use crate::effects::random::normals;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "noise",
    family: Family::Sensor,
    about: "White noise on every conversion.",
    equations: &["code' = code + rms_codes g, g normal, drawn for each conversion"],
    state: "the random numbers' (8 bytes)",
    reference: "ST application note AN4073, averaging against converter noise: a few codes",
    keys: &[Key::number("rms_codes", "Its deviation, in codes of the 12-bit converter.", 0.0, 500.0, 1.5)],
    zero: &[("rms_codes", 0.0)],
    build: |build: &Build| {
        let rms_codes = build.values.number("rms_codes");
        let mut rng = Rng::with_seed(build.seed);
        Part::Codes(Box::new(move |_, _, codes| {
            let noise: Row = normals(&mut rng);
            codes.iter_mut().zip(noise).for_each(|(code, noise)| *code += rms_codes * noise);
        }))
    },
};
