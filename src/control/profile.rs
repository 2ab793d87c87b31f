//! The way still to go to the fastest speed from which the tip can still stop there.
//!
//! The time-optimal speed over the way e with a deceleration a is sqrt(2 a |e|). Its slope is infinite at e = 0, so
//! near the goal a line of slope k takes over where both agree in value and slope (a proximate time-optimal servo):
//!
//! ```text
//! |e| <= a / (2 k^2):  v_ref = k e                                 a_ref = -k v
//! beyond:              v_ref = +-(sqrt(2 a |e|) - a / (2 k))      a_ref = -v a / sqrt(2 a |e|)
//! ```
//!
//! a_ref is the slope of v_ref along the motion: what the loop needs to stay on the curve without a lag.

use crate::arith::product;
use crate::config::gains::Gains;
use crate::units::{Millimetres, MillimetresPerSecond, MillimetresPerSecond2};

/// What the speed loop is to follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reference {
    /// Speed.
    pub speed: MillimetresPerSecond,
    /// Acceleration that keeps the tip on the curve.
    pub acceleration: MillimetresPerSecond2,
}

impl Reference {
    /// The fastest way over `way` that ends at rest, from the speed `speed`, with a deceleration of `brake`: up to 1000
    /// m/s^2.
    #[inline(always)]
    pub fn towards(way: Millimetres, speed: MillimetresPerSecond, brake: MillimetresPerSecond2, gains: &Gains) -> Self {
        let (way_bits, speed_bits) = (way.to_bits(), speed.to_bits());
        let brake_bits = brake.to_bits().max(1);
        let slope = gains.slope_per_s;
        // a / (2 k^2): Q8 to Q24 mm.
        let linear = (i64::from(brake_bits) * i64::from(gains.half_over_slope2_q40)) >> 24;
        let (reference, acceleration) = if i64::from(way_bits.unsigned_abs()) <= linear {
            (product(way_bits, slope, 8), product(speed_bits, slope, 8))
        } else {
            // Q8 mm/s^2 times Q24 mm is Q32 mm^2/s^2; its root is Q16 mm/s, and good enough as the FPU gives it.
            let (root, _) = lanes::root_and_product(2 * brake_bits.cast_unsigned(), way_bits.unsigned_abs(), 0);
            let root = root.cast_signed();
            let magnitude = root.wrapping_sub(product(brake_bits, gains.half_over_slope_q32, 24));
            let reference = if way_bits < 0 { magnitude.wrapping_neg() } else { magnitude };
            (reference, product(brake_bits, share_q12(speed_bits, root), 12))
        };
        Self {
            speed: MillimetresPerSecond::from_bits(reference),
            acceleration: MillimetresPerSecond2::from_bits(acceleration.saturating_neg()),
        }
    }

    /// The same, held to speeds up to `limit`; beyond it there is no curve to stay on.
    #[inline(always)]
    pub fn limited(self, limit: MillimetresPerSecond) -> Self {
        let held = self.speed.max(MillimetresPerSecond::from_bits(limit.to_bits().saturating_neg())).min(limit);
        if held == self.speed { self } else { Self { speed: held, acceleration: MillimetresPerSecond2::ZERO } }
    }
}

/// speed / root in Q12, held to +-1.25, by one 32-bit division.
#[inline(always)]
fn share_q12(speed: i32, root: i32) -> i32 {
    let speed = speed.clamp(-1 << 29, (1 << 29) - 1) << 2;
    // Never 0, nor the -1 by which a division can overflow.
    let root = (root.cast_unsigned() >> 10 | 1).cast_signed();
    (speed / root).clamp(-5120, 5120)
}
