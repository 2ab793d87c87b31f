//! Something near the finger switches, and the array's lines pick it up.

use crate::effects::random::waiting_s;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "burst",
    family: Family::Link,
    about: "Bursts of interference on the conversions.",
    equations: &[
        "bursts begin as a Poisson process of rate_per_s and last length_us",
        "within one: code' = code + amplitude_codes u, u uniform in -1 to 1, drawn for each conversion",
    ],
    state: "begin and end of bursts, the random numbers' (8 bytes)",
    reference: "the bursts of IEC 61000-4-4 as a conversion sees them: repeated, short, of any sign",
    keys: &[
        Key::number("rate_per_s", "Bursts in a second, on average.", 0.0, 10_000.0, 10.0),
        Key::number("length_us", "How long each lasts.", 1.0, 1e6, 300.0),
        Key::number("amplitude_codes", "The largest deviation, in codes of the 12-bit converter.", 0.0, 4096.0, 100.0),
    ],
    zero: &[("amplitude_codes", 0.0)],
    build: |build: &Build| {
        let [rate_per_s, length_us, amplitude_codes] =
            ["rate_per_s", "length_us", "amplitude_codes"].map(|name| build.values.number(name));
        let length_s = length_us * 1e-6;
        let mut rng = Rng::with_seed(build.seed);
        let (mut next_s, mut until_s) = (None, f64::NEG_INFINITY);
        Part::Codes(Box::new(move |_, time_s, codes| {
            let mut begin_s = next_s.unwrap_or_else(|| time_s + waiting_s(&mut rng, rate_per_s));
            while begin_s <= time_s {
                until_s = begin_s + length_s;
                begin_s += waiting_s(&mut rng, rate_per_s);
            }
            next_s = Some(begin_s);
            if time_s < until_s {
                codes.iter_mut().for_each(|code| *code += amplitude_codes * (2.0 * rng.f64() - 1.0));
            }
        }))
    },
};
