//! Travel, speed and disturbance from the encoder and the voltage.
//!
//! A third-order observer whose poles lie together at beta in the z plane. Prediction, then correction by the error
//! e = x_measured - x:
//!
//! ```text
//! x += v T + (u - c v + w) T^2 / 2,   v += (u - c v + w) T
//! x += l1 e,   v += l2 e,   w += l3 e
//! l1 = 1 - beta^3,   l2 = 1.5 (1 - beta)^2 (1 + beta) / T,   l3 = (1 - beta)^3 / T^2
//! ```
//!
//! An error beyond what motion can make in a frame is a jump of the encoder: the observer starts again at the new
//! place, at rest. A limited correction would not work: three integrators behind a limited error swing for ever.

use crate::arith::{nearest_product, nearest_share};
use crate::config::{Config, Gains};
use crate::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2};

/// The estimate at the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observer {
    /// Tip travel from where the observer was zeroed.
    pub travel: Millimetres,
    /// Tip speed.
    pub speed: MillimetresPerSecond,
    /// Acceleration by everything but voltage and back-EMF: contact, friction, and errors of the parameters.
    pub disturbance: MillimetresPerSecond2,
    origin: i32,
}

impl Observer {
    /// Observer at rest at zero.
    pub const fn new() -> Self {
        Self {
            travel: Millimetres::ZERO,
            speed: MillimetresPerSecond::ZERO,
            disturbance: MillimetresPerSecond2::ZERO,
            origin: 0,
        }
    }

    /// Observer at rest, with zero travel at this count.
    pub const fn zeroed_at(encoder: i32) -> Self {
        Self { origin: encoder, ..Self::new() }
    }

    /// Makes this count the zero of the travel, without a change of the motion. Returns the travel there before.
    pub fn zero(&mut self, encoder: i32, config: &Config) -> Millimetres {
        let travel = self.measured(encoder, config);
        self.travel = Millimetres(self.travel.0.saturating_sub(travel.0));
        self.origin = encoder;
        travel
    }

    /// Encoder count at which the travel is zero.
    pub fn origin(&self) -> i32 {
        self.origin
    }

    /// Travel at an encoder count, limited to the type's range less a count.
    pub fn measured(&self, encoder: i32, config: &Config) -> Millimetres {
        config.travel(encoder.wrapping_sub(self.origin))
    }

    /// Advances by a frame; `acceleration` is that by voltage and back-EMF since the last frame (Q8 mm/s^2).
    #[inline(always)]
    pub fn update(&mut self, encoder: i32, acceleration: i32, gains: &Gains, config: &Config) {
        // Q8 mm/s^2 times T (Q37) to Q16 mm/s, and the mean speed over the frame times T to Q24 mm.
        let pushed = acceleration.saturating_add(self.disturbance.to_bits());
        let gained = nearest_product(pushed, config.frame_s_q37, 29);
        let before = self.speed.to_bits();
        let moved = nearest_product(before.saturating_add(gained / 2), config.frame_s_q37, 29);
        let travel = self.travel.to_bits().saturating_add(moved);
        let speed = before.saturating_add(gained);

        let measured = self.measured(encoder, config);
        let error = measured.to_bits().saturating_sub(travel);
        if error.unsigned_abs() > config.jump {
            *self = Self { travel: measured, origin: self.origin, ..Self::new() };
            return;
        }
        let [l1_q31, l2_per_s_q16, l3_per_s2] = gains.observer;
        let disturbance = self.disturbance.to_bits().saturating_add(nearest_product(error, l3_per_s2, 16));
        self.travel = Millimetres::from_bits(travel.saturating_add(nearest_share(error, l1_q31)));
        self.speed = MillimetresPerSecond::from_bits(speed.saturating_add(nearest_product(error, l2_per_s_q16, 24)));
        self.disturbance = MillimetresPerSecond2::from_bits(disturbance);
    }
}
