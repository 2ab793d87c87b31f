//! The contact by its touching angle: equations 2 to 8.
//!
//! The touching angle `theta` of a point of the contact is seen from the hemisphere's centre, `a - d` above the plane.

use crate::angle::{angle_of, arc_tangent, sine_cosine};
use crate::arith::{depth, mul_high, nearest_long_quotient, quotient, radius, rest, square};
use crate::units::{MillimetresPerRadian, Radians, SquareMillimetres};
use fingertip::model::Tip;
use fingertip::root::floor_sqrt;
use fingertip::units::Millimetres;

/// Below the cosine of every touching angle, in Q63: it is 1/20 at the deepest indentation.
const COSINE_MIN: u64 = (1 << 63) / 21;

/// The largest touching angle, at the contact's rim: `theta_max = atan(r_c / (a - d))` (eq. 5).
///
/// Computed as `2 atan(sqrt(d / (2a - d)))`: the half angle's tangent stays below 1 where that of the angle itself
/// reaches 20, and it keeps all its digits at small `d`.
pub fn touching_angle_max(tip: &Tip, d: Millimetres) -> Radians {
    let depth = u64::from(depth(tip, d));
    if depth == 0 {
        return Radians::ZERO;
    }
    let shift = depth.leading_zeros();
    let ratio = quotient(depth << shift, 2 * u64::from(radius(tip)) - depth);
    let tangent_q32 = floor_sqrt(ratio << (64 - shift));
    // Twice the arc tangent in Q32 is the arc tangent in Q31: 7 bits more than wanted.
    Radians::from_bits((arc_tangent(tangent_q32) >> 6).div_ceil(2) as i32)
}

/// The touching angle of the point at `r`: `theta = atan(r / (a - d))` (eq. 2 and 6, solved for the angle).
///
/// `r` counts as within 0 to the contact radius.
pub fn touching_angle(tip: &Tip, r: Millimetres, d: Millimetres) -> Radians {
    let distance = r.max(Millimetres::ZERO).min(tip.contact_radius(d)).to_bits().unsigned_abs();
    let angle_q30 = angle_of(distance, rest(tip, d));
    Radians::from_bits((angle_q30 >> 5).div_ceil(2) as i32).min(touching_angle_max(tip, d))
}

/// Distance from the contact's centre at a touching angle: `r = (a - d) tan(theta)` (eq. 2, 6).
///
/// Computed as a sine over a cosine, both from the half angle. `theta` counts as within 0 to
/// [`touching_angle_max`].
pub fn distance_at(tip: &Tip, theta: Radians, d: Millimetres) -> Millimetres {
    let (sine, cosine) = sine_cosine_of(tip, theta, d);
    let bits = nearest_long_quotient(u128::from(rest(tip, d)) * u128::from(sine), cosine);
    Millimetres::from_bits(bits as i32).min(tip.contact_radius(d))
}

/// Height of the undeformed surface at a touching angle: `Q_z = sqrt(a^2 - (a - d)^2 tan^2(theta))` (eq. 3, 15).
pub fn height_at(tip: &Tip, theta: Radians, d: Millimetres) -> Millimetres {
    tip.particle_length(distance_at(tip, theta, d))
}

/// The deformation at a touching angle: `QC = Q_z - (a - d)` (eq. 4, 16).
pub fn compression_at(tip: &Tip, theta: Radians, d: Millimetres) -> Millimetres {
    tip.compression(distance_at(tip, theta, d), d)
}

/// How fast the distance grows with the touching angle: `dr/dtheta = (a - d) / cos^2(theta)` (eq. 7).
pub fn distance_slope(tip: &Tip, theta: Radians, d: Millimetres) -> MillimetresPerRadian {
    let (_, cosine) = sine_cosine_of(tip, theta, d);
    // Q24 over Q62 to Q16.
    let bits = nearest_long_quotient(u128::from(rest(tip, d)) << 54, mul_high(cosine, cosine));
    MillimetresPerRadian::from_bits(bits as i32)
}

/// The area element for each dtheta dphi: `dS = r dr dphi = (a - d)^2 sin(theta) / cos^3(theta) dtheta dphi` (eq.
/// 8).
///
/// In mm^2/rad^2.
pub fn area_density(tip: &Tip, theta: Radians, d: Millimetres) -> SquareMillimetres {
    let (sine, cosine) = sine_cosine_of(tip, theta, d);
    // Q48 times Q63 over Q61 to Q16.
    let product = u128::from(square(rest(tip, d))) * u128::from(sine);
    let bits = nearest_long_quotient(product >> 34, mul_high(mul_high(cosine, cosine), cosine));
    SquareMillimetres::from_bits(bits as i32)
}

/// Sine and cosine of a touching angle in Q63; the cosine is at least 1/21.
fn sine_cosine_of(tip: &Tip, theta: Radians, d: Millimetres) -> (u64, u64) {
    let theta = theta.max(Radians::ZERO).min(touching_angle_max(tip, d)).to_bits().unsigned_abs();
    let (sine, cosine) = sine_cosine(theta);
    (sine, cosine.max(COSINE_MIN))
}
