//! Warmth: what of a held force the array only seems to feel because it is warmer than at its tare and calibration.
//!
//! A force F on a drifting array reads
//!
//! ```text
//! S = F (1 + a (T - T_gain)) + b A (T - T_zero)
//! ```
//!
//! with a and b the array's coefficients, A its area, T_gain the temperature at its calibration and T_zero that at which
//! the taxels' zero was last learnt. T is the microcontroller's own: a proxy. What warms the array and not the
//! microcontroller, or the other way round, or one of them sooner, it cannot know.
//!
//! As creep, it is added to the goal, not taken off the reading: the guard, the monitor and the model see what the array
//! reads. It moves a goal by half of it at most, whatever the temperature says.

use crate::config::Config;
use crate::units::{Celsius, Newtons};
use fixed::types::I16F16;

/// Degrees that are believed: -64 to 192, in Q16.
const LEAST: i32 = -64 << 16;
const MOST: i32 = 192 << 16;
/// A reading moves what is believed by 2^-10 of the difference.
const SLOW: u32 = 10;

/// The temperatures that the array's drift goes by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Warmth {
    /// The microcontroller's, degrees Celsius in Q32; none before the first reading, and where the term is off.
    chip: Option<i64>,
    /// The same, in Q16, when the zero was last learnt.
    zero: i32,
}

impl Warmth {
    /// Takes a frame's reading of the microcontroller's temperature. Where one stays away, the last counts on.
    #[inline(always)]
    pub fn observe(&mut self, chip: Option<Celsius>, config: &Config) {
        if !config.warm.on() {
            self.chip = None;
        }
        let Some(chip) = chip.filter(|_| config.warm.on()) else { return };
        let chip = chip.to_bits().max(LEAST).min(MOST);
        match &mut self.chip {
            Some(state) => *state += ((i64::from(chip) << 16) - *state) >> SLOW,
            state => {
                *state = Some(i64::from(chip) << 16);
                self.zero = chip;
            }
        }
    }

    /// So much of the zero, Q16 from 0 to 1, is learnt at this temperature.
    pub fn zero(&mut self, share: i32) {
        let way = self.chip.map_or(0, |chip| (chip >> 16) - i64::from(self.zero));
        self.zero += ((way * i64::from(share)) >> 16) as i32;
    }

    /// What a held force reads more than it is, between half of it and half of it less.
    #[inline(always)]
    pub fn force(&self, held: Newtons, config: &Config) -> Newtons {
        let Some(chip) = self.chip else { return Newtons::ZERO };
        let warm = &config.warm;
        let [warmer, since] = [warm.gain_at_q16, self.zero].map(|then| (chip >> 16) - i64::from(then));
        let share = (warmer * i64::from(warm.gain_q32_per_k)) >> 16;
        let held = i64::from(held.to_bits().max(0));
        let half = held >> 1;
        let gain = (held * share.max(-1 << 31).min(1 << 31)) >> 32;
        let zero = (since * i64::from(warm.zero_q24_per_k)) >> 24;
        Newtons(I16F16::from_bits((gain + zero).max(-half).min(half) as i32))
    }
}
