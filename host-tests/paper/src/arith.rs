//! Integer arithmetic, and lengths of a tip as integers in units of the last place.

use fingertip::model::Tip;
use fingertip::units::Millimetres;

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
