//! The way still to go to the fastest speed from which the tip can still stop there.
//!
//! The time-optimal speed over the way e with a deceleration a is sqrt(2 a |e|). Its slope is infinite at e = 0, so near the goal a line of
//! slope k takes over where both agree in value and slope (a proximate time-optimal servo):
//!
//! ```text
//! |e| <= a / (2 k^2):  v_ref = k e                                 a_ref = -k v
//! beyond:              v_ref = +-(sqrt(2 a |e|) - a / (2 k))      a_ref = -v a / sqrt(2 a |e|)
//! ```
//!
//! a_ref is the slope of v_ref along the motion: what the loop needs to stay on the curve without a lag.

use crate::config::Config;
use crate::root::floor_sqrt;
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
    /// The fastest way over `way` that ends at rest, from the speed `speed`, with a deceleration of `brake`.
    pub fn towards(
        way: Millimetres,
        speed: MillimetresPerSecond,
        brake: MillimetresPerSecond2,
        config: &Config,
    ) -> Self {
        let way_bits = i64::from(way.to_bits());
        let brake_bits = i64::from(brake.to_bits().max(1));
        let speed_bits = i64::from(speed.to_bits());
        let slope = i64::from(config.position_gain_per_s);
        // a / (2 k^2): Q8 to Q24 mm.
        let linear = (brake_bits * config.half_over_slope2_q40) >> 24;
        let (reference, acceleration) = if way_bits.abs() <= linear {
            ((way_bits * slope) >> 8, -((speed_bits * slope) >> 8))
        } else {
            // Q8 mm/s^2 times Q24 mm is Q32 mm^2/s^2; its root is Q16 mm/s.
            let root = i64::from(floor_sqrt((2 * brake_bits * way_bits.abs()).unsigned_abs()));
            let magnitude = root - ((brake_bits * config.half_over_slope_q32) >> 24);
            let share = share_q12(speed_bits, root);
            (magnitude * way_bits.signum(), -((brake_bits * share) >> 12))
        };
        Self {
            speed: MillimetresPerSecond::from_bits(reference.clamp(i32::MIN.into(), i32::MAX.into()) as i32),
            acceleration: MillimetresPerSecond2::from_bits(acceleration.clamp(i32::MIN.into(), i32::MAX.into()) as i32),
        }
    }

    /// The same, held to speeds up to `limit`; beyond it there is no curve to stay on.
    pub fn limited(self, limit: MillimetresPerSecond) -> Self {
        let held = self.speed.max(MillimetresPerSecond::from_bits(limit.to_bits().saturating_neg())).min(limit);
        if held == self.speed { self } else { Self { speed: held, acceleration: MillimetresPerSecond2::ZERO } }
    }
}

/// speed / root in Q12, held to +-1.25, by one 32-bit division.
fn share_q12(speed: i64, root: i64) -> i64 {
    let root = ((root >> 10).clamp(1, i64::from(i32::MAX))) as i32;
    let speed = (speed << 2).clamp(i64::from(i32::MIN) + 1, i64::from(i32::MAX)) as i32;
    i64::from((speed / root).clamp(-5120, 5120))
}
