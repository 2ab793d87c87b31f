//! Ways from the indentation to the force, F = pi Y d^2, and back; to the pressure at a distance from the contact's centre,
//! p = Y dL/L in kPa, 0 from the rim on.

use super::scalar::{Call, Number, Tools, Variant, hardware, hardware_q16, variant};
use fingertip::units::{Millimetres, Newtons};
use fixed::types::{I16F16, I32F32};
use micromath::F32Ext;

pub const FORCE: &[Variant] = &[
    variant!("f32", Single f32: |d, _, tools| tools.single.pi_y * d * d),
    variant!("f32, micromath powf", Single f32: |d, _, tools| tools.single.pi_y * F32Ext::powf(d, 2.0)),
    variant!("f64", Double f64: |d, _, tools| tools.double.pi_y * d * d),
    variant!("I16F16, `fixed`", Fixed i32, 16, 16: |d, _, tools| {
        let d = I16F16::from_bits(d);
        (d * d * tools.fixed.pi_y).to_bits()
    }),
    variant!("I16F16 saturating, `fixed`", Fixed i32, 16, 16: |d, _, tools| {
        let d = I16F16::from_bits(d);
        d.saturating_mul(d).saturating_mul(tools.fixed.pi_y).to_bits()
    }),
    variant!("I32F32, `fixed`", Fixed i32, 16, 16: |d, _, tools| {
        let (d, pi_y) = (I32F32::from_bits(i64::from(d) << 16), I32F32::from_bits(i64::from(tools.pi_y_q30) << 2));
        (d * d * pi_y).to_num::<I16F16>().to_bits()
    }),
    // Products in 64 bits, rounded once.
    variant!("Q16, integers", Fixed i32, 16, 16: |d, _, tools| {
        // Below 10 mm the square in Q24 fits 32 bits.
        let square_q24 = (u64::from(d as u32) * u64::from(d as u32)) >> 8;
        ((square_q24 * u64::from(tools.pi_y_q30) + (1 << 37)) >> 38) as i32
    }),
    variant!("**Q24 to Q16, Tip::force**", Fixed i32, 24, 16: |d, _, tools| {
        tools.tip.force(Millimetres::from_bits(d)).to_bits()
    }),
];

pub const INDENTATION: &[Variant] = &[
    variant!("f32, VSQRT", Single f32: |force, _, tools| hardware(force * tools.single.inverse, 0.0, tools)),
    variant!("f32, micromath", Single f32: |force, _, tools| F32Ext::sqrt(force * tools.single.inverse)),
    variant!("f32, libm", Single f32: |force, _, tools| libm::sqrtf(force * tools.single.inverse)),
    variant!("f64, libm", Double f64: |force, _, tools| libm::sqrt(force * tools.double.inverse)),
    variant!("I16F16, `fixed`", Fixed i32, 16, 16: |force, _, tools| {
        (I16F16::from_bits(force) / tools.fixed.pi_y).sqrt().to_bits()
    }),
    variant!("Q16, VSQRT", Fixed i32, 16, 16: |force, _, tools| {
        let square = (u64::from(force as u32) * u64::from(tools.inverse_q30)) >> 30;
        hardware_q16(square as i32, 0, tools)
    }),
    variant!("Q16 to Q24, u64::isqrt", Fixed i32, 16, 24: |force, _, tools| {
        // Q46 to Q48.
        (u64::from(force as u32) * u64::from(tools.inverse_q30) * 4).isqrt() as i32
    }),
    variant!("**Q16 to Q24, Tip::indentation**", Fixed i32, 16, 24: |force, _, tools| {
        tools.tip.indentation(Newtons::from_bits(force)).to_bits()
    }),
];

/// All of them; the first number is r, the second d.
pub const PRESSURE: &[Variant] = &[
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
        (textbook(r * r, d, tools) * I16F16::from_bits(1000 << 16)).to_bits()
    }),
    variant!("I16F16, no cancellation, `fixed`", Fixed i32, 16, 16: |r, d, tools| {
        let (r, d) = (I16F16::from_bits(r), I16F16::from_bits(d));
        (sound(r * r, d, tools) * I16F16::from_bits(1000 << 16)).to_bits()
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
fn textbook<T: Number>(square: T, d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let length = (tip.radius * tip.radius - square).root();
    let compression = length - (tip.radius - d);
    if compression > T::default() { tip.modulus * compression / length } else { T::default() }
}

/// Y (r_c^2 - r^2) / (L (L + a - d)), in N/mm^2.
#[inline(always)]
fn sound<T: Number>(square: T, d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let inside = d * (tip.radius + tip.radius - d) - square;
    if inside > T::default() {
        let length = (tip.radius * tip.radius - square).root();
        tip.modulus * inside / (length * (length + tip.radius - d))
    } else {
        T::default()
    }
}

/// Textbook form of dL/L: the rounding of L dominates the error.
#[inline(always)]
fn strain(square_q16: i32, d: i32, tools: &Tools) -> (u32, u32) {
    let radius = tools.fixed.radius.to_bits();
    // a^2 in Q16.
    let radius_square = (radius >> 8) * (radius >> 8);
    let length = hardware_q16(radius_square - square_q16, 0, tools);
    let compression = (length - (radius - d)).max(0) as u32;
    let shift = compression.leading_zeros().min(31);
    ((compression << shift) / length.max(1) as u32, shift)
}
