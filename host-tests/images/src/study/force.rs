//! Ways from the indentation to the force, F = pi Y d^2, and back.

use super::root::{hardware, hardware_q16};
use super::scalar::{Call, Tools, Variant, variant};
use fingertip::units::{Millimetres, Newtons};
use fixed::types::{I16F16, I32F32};
use micromath::F32Ext;

/// Force from indentation.
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

/// Indentation from force.
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
