//! Creep: what of a force that is held the array only seems to feel.
//!
//! Under a constant force F the reading grows to F (1 + k) with the time constant tau. So of a reading S a part c is
//! creep, c' = (k (S - c) - c) / tau: a lag towards S k / (1 + k) with tau / (1 + k). One state, first order: a frame
//! takes it at most half of the way, so it stays between 0 and the largest target, and cannot ring.
//!
//! It is added to the goal, not taken off the reading: the guard, the monitor and the model see what the array reads.

use crate::config::Config;
use crate::units::Newtons;
use fixed::types::I16F16;

/// The creep of the force that is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Creep {
    /// Q48 N, not below 0.
    state: i64,
}

impl Creep {
    /// Takes a frame's reading; where no force is held, the creep is forgotten: the baseline learns what is left of it.
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

    /// A reading without what of it is creep.
    #[inline(always)]
    pub fn less(&self, reading: Newtons) -> Newtons {
        Newtons(reading.0.saturating_sub(self.force().0))
    }

    /// What of the reading is creep.
    #[inline(always)]
    pub fn force(&self) -> Newtons {
        Newtons(I16F16::from_bits((self.state >> 32) as i32))
    }
}
