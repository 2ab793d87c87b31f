//! Angles: arc tangent, sine and cosine by polynomials in 32 bits after the point.
//!
//! Each series alternates in sign with falling coefficients, so that every intermediate value of its nested form is
//! positive and below 1: one 32 by 32 multiply and one subtraction a term.

use super::arith::quotient;

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

/// `(1 - sin(t)/t) / t^2` in powers of `t^2`: Chebyshev fit on `t` from 0 to pi/4, off by less than 2^-45.
const SINE: [u32; 5] = [715_827_883, 35_791_394, 852_176, 11_835, 107];

/// `(1 - cos(t)) / t^2` in powers of `t^2`: Chebyshev fit on `t` from 0 to pi/4, off by less than 2^-41.
const COSINE: [u32; 5] = [2_147_483_648, 178_956_971, 5_965_231, 106_515, 1_170];

/// The product of two Q0.32 numbers, rounded down.
const fn mul(x: u32, y: u32) -> u32 {
    ((x as u64 * y as u64) >> 32) as u32
}

/// `c0 - z (c1 - z (c2 - ...))` in Q0.32.
fn alternating(coefficients: &[u32], z: u32) -> u32 {
    coefficients.iter().rev().fold(0, |sum, &coefficient| coefficient.wrapping_sub(mul(z, sum)))
}

/// The arc tangent of a Q0.32 number below 1, in Q0.32; off by less than 2^-30.
pub(super) fn arc_tangent(t: u32) -> u32 {
    let z = mul(t, t);
    t - mul(t, mul(z, alternating(&ARC_TANGENT, z)))
}

/// The angle of the point (x, y) above the x axis, `atan(y/x)`, in Q2.30: the two lengths are not negative.
///
/// The quotient is formed the way that makes it at most 1, so the tangent near pi/2 is never needed.
pub(super) fn angle_of(y: u32, x: u32) -> u32 {
    if y == 0 {
        return 0;
    }
    let (small, large) = if y <= x { (y, x) } else { (x, y) };
    let tangent = quotient(u64::from(small) << 32, large.into()).min(u32::MAX.into());
    let angle_q32 = u64::from(arc_tangent(tangent as u32));
    let folded_q32 = if y <= x { angle_q32 } else { 2 * HALF_PI_Q31 - angle_q32 };
    (folded_q32 >> 1).div_ceil(2) as u32
}

/// Sine and cosine, in Q1.31, of an angle in Q8.24 between 0 and pi/2; off by less than 2^-29.
///
/// From the half angle `h`: `sin = 2 sin(h) cos(h)`, `cos = 1 - 2 sin(h)^2`.
pub(super) fn sine_cosine(angle_q24: u32) -> (u32, u32) {
    // Half of an angle in Q24 is 128 times it in Q32; pi/2 leaves it below 1.
    let half = angle_q24 << 7;
    let z = mul(half, half);
    let half_sine = half - mul(half, mul(z, alternating(&SINE, z)));
    let half_cosine = (1_u64 << 32) - u64::from(mul(z, alternating(&COSINE, z)));
    let sine = (u64::from(half_sine) * half_cosine) >> 32;
    (sine as u32, (1 << 31) - mul(half_sine, half_sine))
}
