//! The pace of the loop: quick while there is a way to go, calmer the longer there is none.
//!
//! Rest and speed want different bandwidths. While the way still to go stays within a band that counts and noise explain, the
//! loop falls to the next calmer pace every few of its own time constants; where the way's mean leaves twice that band, it
//! is quick again at once. Only gains change, never what the observer and the drive hold, so a change of pace moves nothing.

use super::gains::{Gains, PACES};
use crate::config::Config;
use crate::units::Millimetres;

/// The way's mean follows it by 1/8 in each frame: white noise counts a quarter.
const MEAN_BITS: u32 = 3;

/// Which pace, and since when.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pace {
    number: usize,
    /// Mean of the way, Q24 mm.
    mean: i32,
    calm_frames: u32,
}

impl Pace {
    /// The quickest.
    pub const QUICK: Self = Self { number: 0, mean: 0, calm_frames: 0 };

    /// The gains at this pace.
    #[inline(always)]
    pub fn gains<'a>(&self, config: &'a Config) -> &'a Gains {
        &config.paces[self.number % PACES]
    }

    /// Whether it is not the quickest.
    #[inline(always)]
    pub fn calm(&self) -> bool {
        self.number > 0
    }

    /// Takes the way still to go in this frame.
    #[inline(always)]
    pub fn note(&mut self, way: Millimetres, config: &Config) {
        let band = config.calm_band.to_bits();
        // Held, so that a long way is soon forgotten.
        let held = way.to_bits().max(-16 * band).min(16 * band);
        self.mean += (held - self.mean) >> MEAN_BITS;
        let mean = self.mean.saturating_abs();
        if mean > 2 * band {
            (self.number, self.calm_frames) = (0, 0);
        } else if mean > band {
            self.calm_frames = 0;
        } else {
            self.calm_frames += 1;
            if self.calm_frames > config.calm_frames << self.number {
                self.number = (self.number + 1).min(PACES - 1);
                self.calm_frames = 0;
            }
        }
    }
}
