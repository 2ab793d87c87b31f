//! The controller's clock is not the world's.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "clock_tolerance",
    family: Family::Link,
    about: "The controller's clock runs fast or slow; its frames come sooner or later.",
    equations: &["a second of the controller lasts 1 / (1 + fast_ppm 10^-6) s"],
    state: "none",
    reference: "STM32F446 data sheet: internal oscillator +-1 % at 25 C; crystals some 50 ppm",
    keys: &[Key::number("fast_ppm", "How much it runs fast; below 0, slow.", -50_000.0, 50_000.0, 50.0)],
    zero: &[("fast_ppm", 0.0)],
    build: |build: &Build| {
        let second_s = 1.0 / (1.0 + build.values.number("fast_ppm") * 1e-6);
        Part::Clock(Box::new(move |_| second_s))
    },
};
