//! Under a held pressure the reading grows with the logarithm of time.

use super::since::Since;
use super::{Pressure, Row};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};
use fingertip::shipped::{COLUMNS, ROWS};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "creep",
    family: Family::Sensor,
    about: "Under a held pressure the reading grows by a share of it in each decade of time.",
    equations: &[
        "p' = p + c sum of x_k, dx_k/dt = (p - x_k) / tau_k, tau_k = 1 ms, 10 ms, ... 10^5 s; c = rate_percent_per_decade / 100",
        "each step exact for a held p: x_k += (p - x_k) (1 - exp(-dt / tau_k))",
        "after a step of p: c p for each decade, within 0.1 % from 1 ms to 1000 s, within 1 % to 3 hours; inside a decade the slope ripples by 11 %",
    ],
    state: "9 numbers for each taxel",
    reference: "Interlink FSR 400 integration guide: drift under 5 % per decade of time; a Prony series with a term for each decade",
    keys: &[Key::number("rate_percent_per_decade", "Growth of the reading.", 0.0, 50.0, 5.0)],
    zero: &[("rate_percent_per_decade", 0.0)],
    build: |build: &Build| {
        let share = build.values.number("rate_percent_per_decade") / 100.0;
        Part::Pressure(Box::new(Creep { share, since: Since::default(), crept_kpa: [[[0.0; COLUMNS]; TERMS]; ROWS] }))
    },
};

const TERMS: usize = 9;
const TAUS_S: [f64; TERMS] = [1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3, 1e4, 1e5];

struct Creep {
    share: f64,
    since: Since,
    crept_kpa: [[Row; TERMS]; ROWS],
}

impl Pressure for Creep {
    fn apply(&mut self, row: usize, time_s: f64, kpa: &mut Row) {
        let step_s = self.since.step_s(row, time_s);
        let mut sum = [0.0; COLUMNS];
        for (crept, tau_s) in self.crept_kpa[row].iter_mut().zip(TAUS_S) {
            let taken = gone(step_s / tau_s);
            for ((crept, kpa), sum) in crept.iter_mut().zip(&*kpa).zip(&mut sum) {
                *crept += taken * (*kpa - *crept);
                *sum += *crept;
            }
        }
        for (kpa, sum) in kpa.iter_mut().zip(sum) {
            *kpa += self.share * sum;
        }
    }
}

/// 1 - exp(-x), without cancelling where x is small: frames are 1e-8 of the slowest term.
fn gone(x: f64) -> f64 {
    if x < 1e-4 { x - 0.5 * x * x + x * x * x / 6.0 } else { 1.0 - decay(x) }
}
