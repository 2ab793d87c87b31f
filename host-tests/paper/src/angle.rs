//! Angles: arc tangent by a polynomial with 32 bits after the point, sine and cosine by ones with 64.
//!
//! Each series alternates in sign with falling coefficients, so that every intermediate value of its nested form is
//! positive and below 1: one multiply and one subtraction a term.

use crate::touching::{mul_high, quotient};

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
