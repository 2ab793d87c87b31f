//! A host that does not keep time.

use crate::effects::random::normal;
use crate::effects::{Build, Part};
use crate::key::{Key, Kind};
use crate::registry::{Description, Family};
use fastrand::Rng;

const SPREADS: &[&str] = &["uniform", "normal"];

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "host_jitter",
    family: Family::Link,
    about: "The host sends each packet later than it meant to. Packets do not overtake one another.",
    equations: &["uniform: late by delay_ms u, u in 0 to 1", "normal: late by delay_ms |g|, g normal"],
    state: "the random numbers' (8 bytes)",
    reference: "wake-up latency of a host without a real-time kernel, 0.1 to 10 ms; USB serial adapters add up to 16 ms",
    keys: &[
        Key::number("delay_ms", "The largest delay (uniform) or its deviation (normal).", 0.0, 1000.0, 2.0),
        Key {
            name: "distribution",
            about: "How the delays are spread.",
            kind: Kind::Word { words: SPREADS, default: Some("uniform") },
        },
    ],
    zero: &[("delay_ms", 0.0)],
    build: |build: &Build| {
        let delay_s = build.values.number("delay_ms") * 1e-3;
        let is_normal = build.values.word("distribution") == "normal";
        let mut rng = Rng::with_seed(build.seed);
        Part::Packets(Box::new(move |sent_s| {
            let draw = if is_normal { normal(&mut rng).abs() } else { rng.f64() };
            Some(sent_s + delay_s * draw)
        }))
    },
};
