//! Compensation of what a held force only seems to be: the array's creep, and its drift with temperature.
//!
//! Both are added to the goal, not subtracted from the reading: the guard, the monitor and the model see what the array
//! reads.
//!
//! # Creep
//!
//! Under a constant force F the reading grows to F (1 + k) with the time constant tau. So a part c of a reading S is
//! creep, c' = (k (S - c) - c) / tau: a lag towards S k / (1 + k) with tau / (1 + k). The lag has one state of first
//! order and moves at most half of the difference in a frame, so it stays between 0 and the largest target, and cannot
//! ring.
//!
//! # Temperature
//!
//! A force F on a drifting array reads
//!
//! ```text
//! S = F (1 + a (T - T_gain)) + b A (T - T_zero)
//! ```
//!
//! with a and b the array's coefficients, A its area, T_gain the temperature at its calibration and T_zero the
//! temperature at which the taxels' zero was last learnt. T is the temperature of the microcontroller: a proxy, which
//! does not show a heat source that warms only one of the two, or one of them sooner. The compensation moves a goal by
//! half of it at most, whatever the temperature.

use crate::config::Config;
use crate::units::{Celsius, Newtons};
use fixed::types::I16F16;

/// Estimate of the creep of the held force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Creep {
    /// Creep, Q48 N, not below 0.
    state: i64,
}

impl Creep {
    /// Takes a frame's reading. While no force is held the creep is 0: the baseline learns what remains of it.
    #[inline(always)]
    pub fn observe(&mut self, held: bool, force: Newtons, config: &Config) {
        if config.creep_share_q32 == 0 || !held {
            self.state = 0;
            return;
        }
        let target = (i64::from(force.to_bits().max(0)) * i64::from(config.creep_share_q32)) >> 32;
        let way = target - (self.state >> 32);
        self.state = self.state.saturating_add(way * i64::from(config.creep_leak_q32));
    }

    /// Returns a reading less its creep.
    #[inline(always)]
    pub fn less(&self, reading: Newtons) -> Newtons {
        Newtons(reading.0.saturating_sub(self.force().0))
    }

    /// Creep in the reading.
    #[inline(always)]
    pub fn force(&self) -> Newtons {
        Newtons(I16F16::from_bits((self.state >> 32) as i32))
    }
}

/// Least temperature that is used, degrees Celsius in Q16.
const LEAST: i32 = -64 << 16;
/// Largest temperature that is used, degrees Celsius in Q16.
const MOST: i32 = 192 << 16;
/// A reading moves the filtered temperature by 2^-10 of the difference.
const SLOW: u32 = 10;

/// Temperatures from which the array's drift is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TemperatureDrift {
    /// Filtered temperature of the microcontroller, degrees Celsius in Q32; none before the first reading, and while
    /// the compensation is off.
    chip: Option<i64>,
    /// Temperature when the zero was last learnt, degrees Celsius in Q16.
    zero: i32,
}

impl TemperatureDrift {
    /// Takes a frame's reading of the microcontroller's temperature. Without a reading the last one is kept.
    #[inline(always)]
    pub fn observe(&mut self, chip: Option<Celsius>, config: &Config) {
        if !config.drift.on() {
            self.chip = None;
        }
        let Some(chip) = chip.filter(|_| config.drift.on()) else { return };
        let chip = chip.to_bits().max(LEAST).min(MOST);
        match &mut self.chip {
            Some(state) => *state += ((i64::from(chip) << 16) - *state) >> SLOW,
            state => {
                *state = Some(i64::from(chip) << 16);
                self.zero = chip;
            }
        }
    }

    /// Takes note that a share of the zero, Q16 from 0 to 1, was learnt at the present temperature.
    pub fn zero(&mut self, share: i32) {
        let way = self.chip.map_or(0, |chip| (chip >> 16) - i64::from(self.zero));
        self.zero += ((way * i64::from(share)) >> 16) as i32;
    }

    /// Returns by how much a held force reads more than it is; at most half of the force, up or down.
    #[inline(always)]
    pub fn force(&self, held: Newtons, config: &Config) -> Newtons {
        let Some(chip) = self.chip else { return Newtons::ZERO };
        let drift = &config.drift;
        let [warmer, since] = [drift.gain_at_q16, self.zero].map(|then| (chip >> 16) - i64::from(then));
        let share = (warmer * i64::from(drift.gain_q32_per_k)) >> 16;
        let held = i64::from(held.to_bits().max(0));
        let half = held >> 1;
        let gain = (held * share.max(-1 << 31).min(1 << 31)) >> 32;
        let zero = (since * i64::from(drift.zero_q24_per_k)) >> 24;
        Newtons(I16F16::from_bits((gain + zero).max(-half).min(half) as i32))
    }
}
