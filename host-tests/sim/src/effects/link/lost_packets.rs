//! Packets that never arrive.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "lost_packets",
    family: Family::Link,
    about: "Packets from the host get lost; what they said arrives with the host's next repetition (period_ms of [host]).",
    equations: &["each packet is lost with the probability lost_percent / 100, whatever became of the others"],
    state: "the random numbers' (8 bytes)",
    reference: "a Bernoulli channel",
    keys: &[Key::number("lost_percent", "Share of the packets that is lost.", 0.0, 100.0, 1.0)],
    zero: &[("lost_percent", 0.0)],
    build: |build: &Build| {
        let lost = build.values.number("lost_percent") / 100.0;
        let mut rng = Rng::with_seed(build.seed);
        Part::Packets(Box::new(move |sent_s| (rng.f64() >= lost).then_some(sent_s)))
    },
};
