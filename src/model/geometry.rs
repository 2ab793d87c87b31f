//! The shape of the deformed tip: equations 1 to 8, 15 and 16.
//!
//! A point of the contact is named by its distance `r` from the contact's centre or by its touching angle `theta`, seen
//! from the hemisphere's centre, `a - d` above the plane.

use super::Tip;
use super::angle::{angle_of, arc_tangent, sine_cosine};
use super::arith::{mul_high, nearest_long_quotient, quotient, root, square};
use crate::root::floor_sqrt;
use crate::units::{Millimetres, MillimetresPerRadian, Radians, SquareMillimetres};

/// Below the cosine of every touching angle, in Q63: it is 1/20 at the deepest indentation.
const COSINE_MIN: u64 = (1 << 63) / 21;

impl Tip {
    /// Height of the undeformed surface over the hemisphere's base at `r`: `z = sqrt(a^2 - r^2)` (eq. 1).
    ///
    /// It is also the free length of the column at `r`, `L` (eq. 15). Correctly rounded. `r` counts as within -a to a.
    pub fn particle_length(&self, r: Millimetres) -> Millimetres {
        Millimetres::from_bits(root(square(self.radius_bits()) - square(self.distance(r))) as i32)
    }

    /// How far the column at `r` is compressed: `dL = sqrt(a^2 - r^2) - (a - d)` inside the contact, 0 outside (eq. 16;
    /// the length QC of eq. 4).
    ///
    /// Correctly rounded: both terms are multiples of the unit, and the root is the nearest one.
    pub fn compression(&self, r: Millimetres, d: Millimetres) -> Millimetres {
        let length = self.particle_length(r).to_bits();
        Millimetres::from_bits((length - self.rest(self.depth(d)) as i32).max(0))
    }

    /// The largest touching angle, at the contact's rim: `theta_max = atan(r_c / (a - d))` (eq. 5).
    ///
    /// Computed as `2 atan(sqrt(d / (2a - d)))`: the half angle's tangent stays below 1 where that of the angle itself
    /// reaches 20, and it keeps all its digits at small `d`.
    pub fn touching_angle_max(&self, d: Millimetres) -> Radians {
        let depth = u64::from(self.depth(d));
        if depth == 0 {
            return Radians::ZERO;
        }
        let shift = depth.leading_zeros();
        let ratio = quotient(depth << shift, 2 * u64::from(self.radius_bits()) - depth);
        let tangent_q32 = floor_sqrt(ratio << (64 - shift));
        // Twice the arc tangent in Q32 is the arc tangent in Q31: 7 bits more than wanted.
        Radians::from_bits((arc_tangent(tangent_q32) >> 6).div_ceil(2) as i32)
    }

    /// The touching angle of the point at `r`: `theta = atan(r / (a - d))` (eq. 2 and 6, solved for the angle).
    ///
    /// `r` counts as within 0 to the contact radius.
    pub fn touching_angle(&self, r: Millimetres, d: Millimetres) -> Radians {
        let distance = r.max(Millimetres::ZERO).min(self.contact_radius(d)).to_bits().unsigned_abs();
        let angle_q30 = angle_of(distance, self.rest(self.depth(d)));
        Radians::from_bits((angle_q30 >> 5).div_ceil(2) as i32).min(self.touching_angle_max(d))
    }

    /// Distance from the contact's centre at a touching angle: `r = (a - d) tan(theta)` (eq. 2, 6).
    ///
    /// Computed as a sine over a cosine, both from the half angle. `theta` counts as within 0 to
    /// [`Tip::touching_angle_max`].
    pub fn distance_at(&self, theta: Radians, d: Millimetres) -> Millimetres {
        let (sine, cosine) = self.sine_cosine(theta, d);
        let bits = nearest_long_quotient(u128::from(self.rest(self.depth(d))) * u128::from(sine), cosine);
        Millimetres::from_bits(bits as i32).min(self.contact_radius(d))
    }

    /// Height of the undeformed surface at a touching angle: `Q_z = sqrt(a^2 - (a - d)^2 tan^2(theta))` (eq. 3, 15).
    pub fn height_at(&self, theta: Radians, d: Millimetres) -> Millimetres {
        self.particle_length(self.distance_at(theta, d))
    }

    /// The deformation at a touching angle: `QC = Q_z - (a - d)` (eq. 4, 16).
    pub fn compression_at(&self, theta: Radians, d: Millimetres) -> Millimetres {
        self.compression(self.distance_at(theta, d), d)
    }

    /// How fast the distance grows with the touching angle: `dr/dtheta = (a - d) / cos^2(theta)` (eq. 7).
    pub fn distance_slope(&self, theta: Radians, d: Millimetres) -> MillimetresPerRadian {
        let (_, cosine) = self.sine_cosine(theta, d);
        // Q24 over Q62 to Q16.
        let bits = nearest_long_quotient(u128::from(self.rest(self.depth(d))) << 54, mul_high(cosine, cosine));
        MillimetresPerRadian::from_bits(bits as i32)
    }

    /// The area element for each dtheta dphi: `dS = r dr dphi = (a - d)^2 sin(theta) / cos^3(theta) dtheta dphi` (eq.
    /// 8).
    ///
    /// In mm^2/rad^2.
    pub fn area_density(&self, theta: Radians, d: Millimetres) -> SquareMillimetres {
        let (sine, cosine) = self.sine_cosine(theta, d);
        // Q48 times Q63 over Q61 to Q16.
        let product = u128::from(square(self.rest(self.depth(d)))) * u128::from(sine);
        let bits = nearest_long_quotient(product >> 34, mul_high(mul_high(cosine, cosine), cosine));
        SquareMillimetres::from_bits(bits as i32)
    }

    /// Sine and cosine of a touching angle in Q63; the cosine is at least 1/21.
    fn sine_cosine(&self, theta: Radians, d: Millimetres) -> (u64, u64) {
        let theta = theta.max(Radians::ZERO).min(self.touching_angle_max(d)).to_bits().unsigned_abs();
        let (sine, cosine) = sine_cosine(theta);
        (sine, cosine.max(COSINE_MIN))
    }

    /// The radius in units of the last place.
    pub(super) const fn radius_bits(&self) -> u32 {
        self.radius().to_bits().unsigned_abs()
    }

    /// What is left between plane and centre, `a - d`, in units of the last place.
    pub(super) const fn rest(&self, depth: u32) -> u32 {
        self.radius_bits() - depth
    }

    /// A distance from the contact's centre, at most a, in units of the last place.
    pub(super) fn distance(&self, r: Millimetres) -> u32 {
        r.to_bits().unsigned_abs().min(self.radius_bits())
    }
}
