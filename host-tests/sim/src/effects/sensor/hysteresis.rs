//! The ink gives back later than it takes: pressing reads low, letting go reads high.

use super::{Pressure, Row};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fingertip::shipped::{COLUMNS, ROWS};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "hysteresis",
    family: Family::Sensor,
    about: "Pressing reads low, letting go reads high, by a share of the pressure.",
    equations: &[
        "a play whose width grows with the pressure: y = clamp(y, p (1 - h/2), p (1 + h/2)), h = width_percent / 100",
        "a cycle 0, P, 0 encloses P^2 w (1 - w) / (1 + w), w = h/2",
    ],
    state: "y of each taxel (100 numbers)",
    reference: "Interlink FSR 400 integration guide: hysteresis +10 %; the play operator: Brokate and Sprekels, Hysteresis and \
                Phase Transitions, 1996, section 2.1",
    keys: &[Key::number(
        "width_percent",
        "How much more it reads letting go than pressing, of the pressure.",
        0.0,
        100.0,
        10.0,
    )],
    zero: &[("width_percent", 0.0)],
    build: |build: &Build| {
        let half = build.values.number("width_percent") / 200.0;
        Part::Pressure(Box::new(Hysteresis { half, held_kpa: [[0.0; COLUMNS]; ROWS] }))
    },
};

struct Hysteresis {
    half: f64,
    held_kpa: [Row; ROWS],
}

impl Pressure for Hysteresis {
    fn apply(&mut self, row: usize, _time_s: f64, kpa: &mut Row) {
        for (held, kpa) in self.held_kpa[row].iter_mut().zip(kpa) {
            // Not clamp(): it panics where a pressure below 0 turns the bounds round.
            *held = held.max(*kpa * (1.0 - self.half)).min(*kpa * (1.0 + self.half));
            *kpa = *held;
        }
    }
}
