//! A converter that is coarser than 12 bits, and bent.

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
        let inl_codes = build.values.number("inl_codes");
        Part::Codes(Box::new(move |_, _, codes| {
            for code in codes {
                let x = (*code / Array::CODES).clamp(0.0, 1.0);
                *code = ((*code + inl_codes * 4.0 * x * (1.0 - x)) / step).floor() * step;
            }
        }))
    },
};
