//! The contact by its touching angle: equations 2 to 8.
//!
//! The touching angle `theta` of a point of the contact is seen from the hemisphere's centre, `a - d` above the plane.
//!
//! At the end angles: arc tangent by a polynomial with 32 bits after the point, sine and cosine by ones with 64. Each series
//! alternates in sign with falling coefficients, so that every intermediate value of its nested form is positive and below 1:
//! one multiply and one subtraction a term.

use crate::units::{MillimetresPerRadian, Radians, SquareMillimetres};
use fingertip::arith::floor_sqrt;
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres, Newtons, Strain};

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

/// Slope of the distance over the touching angle: `dr/dtheta = (a - d) / cos^2(theta)` (eq. 7).
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

/// The upper half of a product of 64 by 64 bits.
pub(crate) const fn mul_high(x: u64, y: u64) -> u64 {
    ((x as u128 * y as u128) >> 64) as u64
}

/// A quotient rounded down; 0 when the denominator is.
pub(crate) const fn quotient(numerator: u64, denominator: u64) -> u64 {
    match numerator.checked_div(denominator) {
        Some(quotient) => quotient,
        None => 0,
    }
}

/// A long quotient rounded to nearest; 0 when the denominator is. Costs about as much as ten short ones.
pub(crate) const fn nearest_long_quotient(numerator: u128, denominator: u64) -> u64 {
    match (numerator + (denominator / 2) as u128).checked_div(denominator as u128) {
        Some(quotient) => quotient as u64,
        None => 0,
    }
}

/// The square of a length in Q24, in Q48.
pub(crate) const fn square(x: u32) -> u64 {
    x as u64 * x as u64
}

/// The radius a.
pub(crate) const fn radius(tip: &Tip) -> u32 {
    tip.radius().to_bits().unsigned_abs()
}

/// The indentation within its domain.
pub(crate) fn depth(tip: &Tip, d: Millimetres) -> u32 {
    d.max(Millimetres::ZERO).min(tip.depth_max()).to_bits().unsigned_abs()
}

/// The distance between plane and centre, `a - d`.
pub(crate) fn rest(tip: &Tip, d: Millimetres) -> u32 {
    radius(tip) - depth(tip, d)
}

// One column of the tip: equations 9 to 13.
//
// Each is a ratio or a product, rounded once; what does not fit the result's range stops at its end. Compression
// counts as positive, the other way round than in the paper's equation 10.

/// The stress of a column, `sigma = F/S` (eq. 9), which is also the pressure on it, `P = F/S` (eq. 12).
///
/// Without an area it is 0.
pub fn pressure_of(force: Newtons, area: SquareMillimetres) -> Kilopascals {
    // 1 N/mm^2 is 1000 kPa.
    let numerator = (i64::from(force.to_bits()) * 1000) << 16;
    Kilopascals::from_bits(saturate(divide(numerator.into(), area.to_bits().into())))
}

/// The compressional strain of a column, `e = dL/L` (eq. 10).
///
/// Without a length it is 0.
pub fn strain_of(compression: Millimetres, length: Millimetres) -> Strain {
    let numerator = i64::from(compression.to_bits()) << 30;
    Strain::from_bits(saturate(divide(numerator.into(), length.to_bits().into())))
}

/// The force on a column under a pressure, `F = P S` (eq. 13).
pub fn force_on(pressure: Kilopascals, area: SquareMillimetres) -> Newtons {
    let product = i64::from(pressure.to_bits()) * i64::from(area.to_bits());
    Newtons::from_bits(saturate(divide(product.into(), 1000 << 16)))
}

/// The force on a column compressed by `dL` from its length `L`, `F = Y (dL/L) S` (eq. 11, 13).
///
/// Without a length it is 0.
pub fn particle_force(tip: &Tip, compression: Millimetres, length: Millimetres, area: SquareMillimetres) -> Newtons {
    let pull = i64::from(tip.modulus().to_bits()) * i64::from(area.to_bits());
    let numerator = i128::from(pull) * i128::from(compression.to_bits());
    Newtons::from_bits(saturate(divide(numerator, (i128::from(length.to_bits()) * 1000) << 16)))
}

/// A quotient rounded to nearest, halves away from zero; 0 when the denominator is.
const fn divide(numerator: i128, denominator: i128) -> i128 {
    if denominator == 0 {
        return 0;
    }
    let magnitude = (numerator.unsigned_abs() + denominator.unsigned_abs() / 2) / denominator.unsigned_abs();
    if (numerator < 0) == (denominator < 0) { magnitude as i128 } else { -(magnitude as i128) }
}

/// The nearest 32-bit number.
fn saturate(wide: i128) -> i32 {
    wide.clamp(i32::MIN.into(), i32::MAX.into()) as i32
}

/// pi/2 in Q1.31.
const HALF_PI_Q31: u64 = 3_373_259_426;

/// `(1 - atan(t)/t) / t^2` in powers of `t^2`: Chebyshev fit on `t` from 0 to 1, off by less than 2^-33.
const ARC_TANGENT: [u32; 12] = [
    1_431_655_765,
    858_993_380,
    613_562_917,
    477_144_766,
    389_706_139,
    325_844_258,
    268_277_195,
    203_129_613,
    128_475_838,
    60_442_746,
    18_131_883,
    2_547_104,
];

/// `(1 - sin(t)/t) / t^2` in powers of `t^2`, Q0.64: 1/3!, 1/5!, ..; what is left out is below 2^-53 for `t` up to
/// pi/4.
const SINE: [u64; 7] = [
    3_074_457_345_618_258_603,
    153_722_867_280_912_930,
    3_660_068_268_593_165,
    50_834_281_508_238,
    462_129_831_893,
    2_962_370_717,
    14_106_527,
];

/// `(1 - cos(t)) / t^2` in powers of `t^2`, Q0.64: 1/2!, 1/4!, ..; what is left out is below 2^-55 for `t` up to pi/4.
const COSINE: [u64; 8] = [
    9_223_372_036_854_775_808,
    768_614_336_404_564_651,
    25_620_477_880_152_155,
    457_508_533_574_146,
    5_083_428_150_824,
    38_510_819_324,
    211_597_908,
    881_658,
];

/// The product of two Q0.32 numbers, rounded down.
const fn mul(x: u32, y: u32) -> u32 {
    ((x as u64 * y as u64) >> 32) as u32
}

/// `c0 - z (c1 - z (c2 - ...))` in Q0.32.
fn alternating(coefficients: &[u32], z: u32) -> u32 {
    coefficients.iter().rev().fold(0, |sum, &coefficient| coefficient.wrapping_sub(mul(z, sum)))
}

/// The arc tangent of a Q0.32 number below 1, in Q0.32; off by less than 2^-30.
pub(crate) fn arc_tangent(t: u32) -> u32 {
    let z = mul(t, t);
    t - mul(t, mul(z, alternating(&ARC_TANGENT, z)))
}

/// Angle of the point (x, y) above the x axis, `atan(y/x)`, in Q2.30, for x and y of at least 0.
///
/// The smaller length is divided by the larger one, so the tangent near pi/2 is never needed.
pub(crate) fn angle_of(y: u32, x: u32) -> u32 {
    if y == 0 {
        return 0;
    }
    let (small, large) = if y <= x { (y, x) } else { (x, y) };
    let tangent = quotient(u64::from(small) << 32, large.into()).min(u32::MAX.into());
    let angle_q32 = u64::from(arc_tangent(tangent as u32));
    let folded_q32 = if y <= x { angle_q32 } else { 2 * HALF_PI_Q31 - angle_q32 };
    (folded_q32 >> 1).div_ceil(2) as u32
}

/// `c0 - z (c1 - z (c2 - ...))` in Q0.64.
fn alternating_long(coefficients: &[u64], z: u64) -> u64 {
    coefficients.iter().rev().fold(0, |sum, &coefficient| coefficient.wrapping_sub(mul_high(z, sum)))
}

/// Sine and cosine, in Q1.63, of an angle in Q8.24 between 0 and pi/2; off by less than 2^-50.
///
/// From the half angle `h`: `sin = 2 sin(h) cos(h)`, `cos = 1 - 2 sin(h)^2`. What is divided by the cosine, near 1/20
/// for a deep contact, has it to 45 bits.
pub(crate) fn sine_cosine(angle_q24: u32) -> (u64, u64) {
    // Half of an angle in Q24 is 2^39 times it in Q64; pi/2 leaves it below 1.
    let half = u64::from(angle_q24) << 39;
    let z = mul_high(half, half);
    let half_sine = half - mul_high(half, mul_high(z, alternating_long(&SINE, z)));
    let half_cosine_q63 = (1 << 63) - mul_high(z, alternating_long(&COSINE, z)) / 2;
    (2 * mul_high(half_sine, half_cosine_q63), (1 << 63) - mul_high(half_sine, half_sine))
}
