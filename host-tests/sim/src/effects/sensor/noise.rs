//! Noise of amplifiers and converter.

use super::{Codes, Row};
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
        Part::Codes(Box::new(Noise { rms_codes, rng: Rng::with_seed(build.seed) }))
    },
};

struct Noise {
    rms_codes: f64,
    rng: Rng,
}

impl Codes for Noise {
    fn apply(&mut self, _slot: usize, _time_s: f64, codes: &mut Row) {
        let noise: Row = normals(&mut self.rng);
        codes.iter_mut().zip(noise).for_each(|(code, noise)| *code += self.rms_codes * noise);
    }
}
