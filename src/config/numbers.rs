//! Numbers for the loop from those of the parameters.

use crate::units::{Millimetres, MillimetresPerSecond, Newtons};
use fixed::types::{I8F24, I16F16};

/// 2^n, exactly.
pub(crate) const fn exp2(n: u32) -> f32 {
    (1u64 << n) as f32
}

/// A constant for the loop: well inside 62 bits, so that doubling it cannot overflow.
// Kept apart, as the next: a dozen copies would fill a sixtieth of the flash.
#[inline(never)]
pub(super) fn wide(value: f32) -> i64 {
    value.clamp(-4e18, 4e18) as i64
}

/// The same for what the loop multiplies with 32 bits: an acceleration within its type, 8388 m/s^2.
pub(crate) fn narrow(value: f32) -> i32 {
    wide(value).min(i64::from(i32::MAX)) as i32
}

/// `value / 1000` in units of 2^-bits, rounded.
#[inline(never)]
pub(super) const fn thousandths(value: i32, bits: u32) -> i32 {
    ((((value as i64) << (bits + 1)) / 1000 + 1) >> 1) as i32
}

pub(crate) fn millimetres(um: i32) -> Millimetres {
    Millimetres(I8F24::from_bits(thousandths(um, 24)))
}

/// A force in N from mN, rounded.
pub fn newtons(mn: i32) -> Newtons {
    Newtons(I16F16::from_bits(thousandths(mn, 16)))
}

pub(crate) fn speed(um_per_s: i32) -> MillimetresPerSecond {
    MillimetresPerSecond(I16F16::from_bits(thousandths(um_per_s, 16)))
}
