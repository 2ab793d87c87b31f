//! The pace of the loop: quick while there is a way to go, calmer the longer there is none.
//!
//! Rest and speed want different bandwidths. The calmest pace is for ways within twice a band that counts and noise
//! explain, each quicker one for ways twice as long. Where the way's mean is longer, the loop is quicker at once; where
//! it was half as long for four of the loop's own time constants, it is calmer. A loop that swings therefore slows
//! down, however it came to swing. Only gains change, never what the observer and the drive hold, so a change of pace
//! moves nothing.

use crate::config::Config;
use crate::config::gains::{Gains, PACES};
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
        while self.number > 0 && mean > reach(band, self.number) {
            (self.number, self.calm_frames) = (self.number - 1, 0);
        }
        if self.number + 1 < PACES && mean <= reach(band, self.number + 1) / 2 {
            self.calm_frames += 1;
            if self.calm_frames > config.calm_frames << self.number {
                (self.number, self.calm_frames) = (self.number + 1, 0);
            }
        } else {
            self.calm_frames = 0;
        }
    }
}

/// The longest way for which a pace is quick enough: two bands at the calmest, twice that at each quicker one.
const fn reach(band: i32, number: usize) -> i32 {
    band << (PACES - number)
}
