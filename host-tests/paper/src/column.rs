//! One column of the tip: equations 9 to 13.
//!
//! Each is a ratio or a product, rounded once; what does not fit the result's range stops at its end. Compression
//! counts as positive, the other way round than in the paper's equation 10.

use crate::units::SquareMillimetres;
use fingertip::model::Tip;
use fingertip::units::{Kilopascals, Millimetres, Newtons, Strain};

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
