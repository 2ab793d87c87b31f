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
//! An error beyond what motion can make in a frame is a jump of the encoder: the observer starts anew at the new place, at
//! rest. To correct by a part of it would not do: three integrators behind an error that is cut swing for ever.

use crate::config::Config;
use crate::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2};

/// The estimate at the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observer {
    /// Tip travel from where the observer was zeroed.
    pub travel: Millimetres,
    /// Tip speed.
    pub speed: MillimetresPerSecond,
    /// Acceleration by everything but the voltage: contact, friction, and what the parameters get wrong.
    pub disturbance: MillimetresPerSecond2,
    origin: i32,
}

impl Observer {
    /// At rest at zero.
    pub const fn new() -> Self {
        Self {
            travel: Millimetres::ZERO,
            speed: MillimetresPerSecond::ZERO,
            disturbance: MillimetresPerSecond2::ZERO,
            origin: 0,
        }
    }

    /// At rest, with zero travel at this count.
    pub const fn zeroed_at(encoder: i32) -> Self {
        Self { origin: encoder, ..Self::new() }
    }

    /// Travel that an encoder count means, Q24 mm, held to the type's range.
    pub fn measured(&self, encoder: i32, config: &Config) -> Millimetres {
        let counts = i64::from(encoder.wrapping_sub(self.origin)).max(-config.counts_max).min(config.counts_max);
        Millimetres::from_bits(saturate((counts * config.mm_per_count_q40) >> 16))
    }

    /// One frame on: `acceleration` is what voltage and back-EMF gave since the last one (Q8 mm/s^2).
    pub fn update(&mut self, encoder: i32, acceleration: i64, config: &Config) {
        let total = i64::from(saturate(acceleration + i64::from(self.disturbance.to_bits())));
        let speed_before = i64::from(self.speed.to_bits());
        let gained = round_shift(total * config.frame_s_q40, 32);
        // Mean speed over the frame, Q16, times T (Q40), to Q24 mm.
        let moved = round_shift((speed_before + gained / 2) * config.frame_s_q40, 32);
        let travel = i64::from(self.travel.to_bits()) + moved;
        let speed = speed_before + gained;

        let measured = self.measured(encoder, config);
        let error = i64::from(measured.to_bits()) - travel;
        if error.abs() > config.jump {
            *self = Self { travel: measured, origin: self.origin, ..Self::new() };
            return;
        }
        let [l1_q32, l2_per_s_q16, l3_per_s2] = config.observer_gains;
        self.travel = Millimetres::from_bits(saturate(travel + round_shift(error * l1_q32, 32)));
        self.speed = MillimetresPerSecond::from_bits(saturate(speed + round_shift(error * l2_per_s_q16, 24)));
        self.disturbance = MillimetresPerSecond2::from_bits(saturate(
            i64::from(self.disturbance.to_bits()) + round_shift(error * l3_per_s2, 16),
        ));
    }
}

/// `value / 2^shift`, rounded to nearest.
fn round_shift(value: i64, shift: u32) -> i64 {
    (value + (1 << (shift - 1))) >> shift
}

fn saturate(value: i64) -> i32 {
    value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
