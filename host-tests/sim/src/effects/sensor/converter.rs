//! A converter that is coarser than 12 bits, and bent.

use super::{Codes, Row};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use crate::setup::Array;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "converter",
    family: Family::Sensor,
    about: "A converter with fewer bits than 12 and with an integral non-linearity.",
    equations: &[
        "bow: c = code + inl_codes 4 x (1 - x), x = code / 4096 within 0 to 1",
        "code' = floor(c / q) q, q = 2^(12 - bits)",
    ],
    state: "none",
    reference: "Tekscan I-Scan, the paper's kind of sensor: 8 bits; STM32F446 data sheet: INL 2 to 3 codes of 12 bits",
    keys: &[
        Key::whole("bits", "Resolution.", 1, 12, 8),
        Key::number(
            "inl_codes",
            "Largest deviation from the straight line, in the middle, in codes of the 12-bit converter.",
            -50.0,
            50.0,
            0.0,
        ),
    ],
    zero: &[("bits", 12.0), ("inl_codes", 0.0)],
    build: |build: &Build| {
        let step = f64::from(1 << (12 - build.values.whole("bits")));
        Part::Codes(Box::new(Converter { step, inl_codes: build.values.number("inl_codes") }))
    },
};

struct Converter {
    step: f64,
    inl_codes: f64,
}

impl Codes for Converter {
    fn apply(&mut self, _slot: usize, _time_s: f64, codes: &mut Row) {
        for code in codes {
            let x = (*code / Array::CODES).clamp(0.0, 1.0);
            *code = ((*code + self.inl_codes * 4.0 * x * (1.0 - x)) / self.step).floor() * self.step;
        }
    }
}
