//! No two taxels are alike.

use super::{Pressure, Row};
use crate::effects::random::normal_within_3;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;
use fingertip::shipped::ROWS;

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "gain_spread",
    family: Family::Sensor,
    about: "Each taxel has a gain of its own.",
    equations: &[
        "p' = p max(0, 1 + s g), s = rms_percent / 100, g of each taxel normal, drawn once, within 3 deviations",
    ],
    state: "none; 100 gains drawn at the start",
    reference: "Interlink FSR 400 integration guide: part to part +-6 %; Tekscan sensors differ by 5 to 32 %",
    keys: &[Key::number("rms_percent", "Deviation of the taxels' gains.", 0.0, 50.0, 6.0)],
    zero: &[("rms_percent", 0.0)],
    build: |build: &Build| {
        let mut rng = Rng::with_seed(build.seed);
        let share = build.values.number("rms_percent") / 100.0;
        let gains: [Row; ROWS] =
            [(); ROWS].map(|()| Row::default().map(|_| (1.0 + share * normal_within_3(&mut rng)).max(0.0)));
        Part::Pressure(Box::new(GainSpread { gains }))
    },
};

struct GainSpread {
    gains: [Row; ROWS],
}

impl Pressure for GainSpread {
    fn apply(&mut self, row: usize, _time_s: f64, kpa: &mut Row) {
        kpa.iter_mut().zip(self.gains[row]).for_each(|(kpa, gain)| *kpa *= gain);
    }
}
