//! Ways to the pressure at a distance from the contact's centre, p = Y dL/L in kPa, 0 from the rim on.

use super::number::Number;
use super::root::hardware_q16;
use super::scalar::{Call, Tools, Variant, variant};
use fingertip::units::Millimetres;
use fixed::types::I16F16;
use micromath::F32Ext;

/// All of them; the first number is r, the second d.
pub const VARIANTS: &[Variant] = &[
    variant!("f32, textbook", Single f32: |r, d, tools| textbook(r * r, d, tools) * 1000.0),
    variant!("f32, no cancellation", Single f32: |r, d, tools| sound(r * r, d, tools) * 1000.0),
    variant!("f32, micromath", Single f32: |r, d, tools| {
        let tip = &tools.single;
        let inside = d * (tip.radius + tip.radius - d) - r * r;
        if inside > 0.0 {
            let length = F32Ext::sqrt(tip.radius * tip.radius - r * r);
            1000.0 * tip.modulus * inside * F32Ext::recip(length * (length + tip.radius - d))
        } else {
            0.0
        }
    }),
    variant!("f64, textbook", Double f64: |r, d, tools| textbook(r * r, d, tools) * 1000.0),
    variant!("f64, no cancellation", Double f64: |r, d, tools| sound(r * r, d, tools) * 1000.0),
    variant!("I16F16, textbook, `fixed`", Fixed i32, 16, 16: |r, d, tools| {
        let (r, d) = (I16F16::from_bits(r), I16F16::from_bits(d));
        (textbook(r * r, d, tools) * I16F16::from_small(1000)).to_bits()
    }),
    variant!("I16F16, no cancellation, `fixed`", Fixed i32, 16, 16: |r, d, tools| {
        let (r, d) = (I16F16::from_bits(r), I16F16::from_bits(d));
        (sound(r * r, d, tools) * I16F16::from_small(1000)).to_bits()
    }),
    variant!("Q16, VSQRT and UDIV", Fixed i32, 16, 16: |r, d, tools| {
        let square = ((i64::from(r) * i64::from(r)) >> 16) as i32;
        let (quotient, shift) = strain(square, d, tools);
        // 250 kPa in Q16.
        ((u64::from(quotient) * (250 << 16)) >> shift) as i32
    }),
    variant!("**Q24 to Q16, Tip::pressure**", Fixed i32, 24, 16: |r, d, tools| {
        tools.tip.pressure(Millimetres::from_bits(r), Millimetres::from_bits(d)).to_bits()
    }),
];

/// Y (L - (a - d)) / L, in N/mm^2.
#[inline(always)]
pub fn textbook<T: Number>(square: T, d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let length = (tip.radius * tip.radius - square).root();
    let compression = length - (tip.radius - d);
    if compression > T::from_small(0) { tip.modulus * compression / length } else { T::from_small(0) }
}

/// Y (r_c^2 - r^2) / (L (L + a - d)), in N/mm^2.
#[inline(always)]
pub fn sound<T: Number>(square: T, d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let inside = d * (tip.radius + tip.radius - d) - square;
    if inside > T::from_small(0) {
        let length = (tip.radius * tip.radius - square).root();
        tip.modulus * inside / (length * (length + tip.radius - d))
    } else {
        T::from_small(0)
    }
}

/// Textbook form of dL/L: the rounding of L dominates the error.
#[inline(always)]
pub fn strain(square_q16: i32, d: i32, tools: &Tools) -> (u32, u32) {
    let radius = tools.fixed.radius.to_bits();
    // a^2 in Q16.
    let radius_square = (radius >> 8) * (radius >> 8);
    let length = hardware_q16(radius_square - square_q16, 0, tools);
    let compression = (length - (radius - d)).max(0) as u32;
    let shift = compression.leading_zeros().min(31);
    ((compression << shift) / length.max(1) as u32, shift)
}
