//! Every taxel's reading starts from a level of its own.

use super::Row;
use crate::effects::random::normal_within_3;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;
use fingertip::shipped::SLOTS;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "offset",
    family: Family::Sensor,
    about: "Each taxel, and each column with no row driven, reads from a level of its own; the tare takes it out.",
    equations: &["code' = code + rms_codes g, g of each taxel normal, drawn once, within 3 deviations"],
    state: "none; 110 levels drawn at the start",
    reference: "docs/board.md: the preload's spread and the amplifiers' offsets",
    keys: &[Key::number("rms_codes", "Deviation of the levels, in codes of the 12-bit converter.", 0.0, 200.0, 5.0)],
    zero: &[("rms_codes", 0.0)],
    build: |build: &Build| {
        let mut rng = Rng::with_seed(build.seed);
        let rms_codes = build.values.number("rms_codes");
        let offsets = [(); SLOTS].map(|()| Row::default().map(|_| rms_codes * normal_within_3(&mut rng)));
        Part::Codes(Box::new(move |slot, _, codes| {
            codes.iter_mut().zip(offsets[slot]).for_each(|(code, offset)| *code += offset);
        }))
    },
};
