//! A gain for each taxel from all presses together, with its standard uncertainty.

use super::number::{BITS, ONE, div, mul, root};
use super::series::{STEPS, Series};
use crate::config::Config;
use crate::pressure::{GAIN_ONE, Gains};
use crate::root::floor_sqrt;

/// The uncertainty of a taxel that no press reached.
pub const UNKNOWN: u8 = u8::MAX;
/// Of the highest expected pressure a taxel must have this part to count in a press: a 24th.
const REACHED_PART: i64 = 24;
/// What the model leaves in a gain, however well it repeats: 0.3 %.
const FLOOR: i64 = ONE * 3 / 1_000;

/// Fractional bits of a sum: 200 presses of the deepest stay within 32 bits.
const SUM_BITS: u32 = 23;

/// Products of readings and expectations, weighted by the pressure: shares of Y, Q23.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sums {
    /// Of the reading and what was expected.
    both: i32,
    /// Of what was expected, squared.
    expected: i32,
    /// Of the reading, squared.
    reading: i32,
    /// The highest expected, Q30.
    highest: i32,
    presses: u8,
}

impl Sums {
    /// Of nothing.
    pub const NONE: Self = Self { both: 0, expected: 0, reading: 0, highest: 0, presses: 0 };

    /// Of a press.
    pub fn of(reading: &Series, expected: &Series, travel: &[Option<i64>; STEPS]) -> Self {
        let (mut sums, mut highest) = ([0; 3], 0);
        for ((u, model), travel) in reading.iter().zip(expected).zip(travel) {
            if travel.is_some() {
                for (sum, part) in sums.iter_mut().zip([mul(*u, *model), mul(*model, *model), mul(*u, *u)]) {
                    *sum += part;
                }
                highest = *model.max(&highest);
            }
        }
        let [both, expected, reading] = sums.map(|sum| short(sum >> (BITS - SUM_BITS)));
        Self { both, expected, reading, highest: short(highest), presses: 1 }
    }

    /// As it is kept among a press's readings.
    pub fn to_words(self) -> [i32; 4] {
        [self.both, self.expected, self.reading, self.highest]
    }

    /// The inverse, of a press that has something.
    pub fn from_words([both, expected, reading, highest]: [i32; 4]) -> Self {
        Self { both, expected, reading, highest, presses: u8::from(expected > 0) }
    }

    /// What the taxel reads for 1 that it should; 0 where nothing was expected.
    pub fn share(&self) -> i64 {
        ratio(self.both.into(), self.expected.into())
    }

    /// Takes another press, where it reached the taxel.
    pub fn add(&mut self, press: &Self, highest: i64) {
        if i64::from(press.highest) >= highest / REACHED_PART && press.expected > 0 {
            *self = Self {
                both: self.both.saturating_add(press.both),
                expected: self.expected.saturating_add(press.expected),
                reading: self.reading.saturating_add(press.reading),
                highest: self.highest.max(press.highest),
                presses: self.presses.saturating_add(press.presses),
            };
        }
    }

    /// The standard uncertainty of [`Sums::share`]: what the readings scatter about it, as if those of a press were one.
    fn sigma(&self) -> i64 {
        let share = self.share();
        let scatter = (ratio(self.reading.into(), self.expected.into()) - mul(share, share)).max(0);
        root(scatter.checked_div(self.presses.into()).unwrap_or(0) + mul(FLOOR, FLOOR))
    }
}

/// Of sums, which are below 2^32.
fn ratio(x: i64, y: i64) -> i64 {
    div(x, y)
}

/// Held to 32 bits.
fn short(x: i64) -> i32 {
    x.max(i32::MIN.into()).min(i32::MAX.into()) as i32
}

/// What the presses propose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Proposal<const ROWS: usize, const COLUMNS: usize> {
    /// The gains; those in force where no press reached a taxel.
    pub gains: Gains<ROWS, COLUMNS>,
    /// Their standard uncertainty, permille of them; [`UNKNOWN`] where no press reached a taxel.
    pub sigmas: [[u8; COLUMNS]; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Proposal<ROWS, COLUMNS> {
    /// Nothing.
    pub const NONE: Self = Self { gains: Gains::ONE, sigmas: [[UNKNOWN; COLUMNS]; ROWS] };

    /// Proposes a taxel's gain; false where no press reached it, or it reads nothing.
    pub fn set(&mut self, place: usize, sums: &Sums, gain: u16, config: &Config) -> bool {
        let share = sums.share();
        let known = sums.presses > 0 && share > ONE / 8;
        let (gain, sigma) = if known {
            let wanted = wanted(gain, share, mul(sums.highest.into(), share), config);
            let [least, most] = [Gains::<ROWS, COLUMNS>::MIN, Gains::<ROWS, COLUMNS>::MAX].map(i64::from);
            let sigma = (div(sums.sigma(), share) * 1_000 + ONE / 2) >> BITS;
            (wanted.max(least).min(most) as u16, sigma.max(1).min(i64::from(UNKNOWN) - 1) as u8)
        } else {
            (if gain == 0 { GAIN_ONE } else { gain }, UNKNOWN)
        };
        self.gains.set(place, gain);
        if let Some(own) = self.sigmas.as_flattened_mut().get_mut(place) {
            *own = sigma;
        }
        known
    }
}

/// The gain with which a taxel reads what it should, where it reads a share of that now, and at most so much in shares
/// of Y.
///
/// The gain acts on codes u, and what they carry is u (1 + p u) / (1 + p) of the full range. So it is the ratio of the
/// codes that count: at three quarters of the highest reading, where most of the weight is.
fn wanted(gain: u16, share: i64, highest: i64, config: &Config) -> i64 {
    let permille = i64::from(config.params.curve_permille);
    let factor = if permille == 0 {
        div(ONE, share)
    } else {
        let carried = ((highest.min(ONE) / 4 * 3).max(0) * i64::from(config.geometry.modulus_q8)) >> 24;
        div(codes(div(carried, share), permille), codes(carried, permille))
    };
    (i64::from(gain) * factor + ONE / 2) >> BITS
}

/// p times the codes that carry a share of the full range: sqrt(1/4 + p (1 + p) c) - 1/2, Q20.
fn codes(carried: i64, permille: i64) -> i64 {
    let inside = (1 << 18) + permille * (1_000 + permille) * (carried >> (BITS - 20)) / 1_000_000;
    (i64::from(floor_sqrt(inside.max(0).unsigned_abs() << 20)) - (1 << 19)).max(1)
}
