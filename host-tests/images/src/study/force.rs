//! Ways from the indentation to the force, F = pi Y d^2, and back.

use super::root::{hardware, hardware_q16};
use super::scalar::{Call, Tools, Variant};
use fingertip::units::{Millimetres, Newtons};
use fixed::types::{I16F16, I32F32};
use micromath::F32Ext;

/// Force from indentation.
pub const FORCE: &[Variant] = &[
    ("f32", Call::Single(single)),
    ("f32, micromath powf", Call::Single(micro)),
    ("f64", Call::Double(double)),
    ("I16F16, `fixed`", Call::Fixed(fixed_point, 16, 16)),
    ("I16F16 saturating, `fixed`", Call::Fixed(saturating, 16, 16)),
    ("I32F32, `fixed`", Call::Fixed(wide, 16, 16)),
    ("Q16, integers", Call::Fixed(integer, 16, 16)),
    ("**Q24 to Q16, Tip::force**", Call::Fixed(firmware, 24, 16)),
];

/// Indentation from force.
pub const INDENTATION: &[Variant] = &[
    ("f32, VSQRT", Call::Single(single_back)),
    ("f32, micromath", Call::Single(micro_back)),
    ("f32, libm", Call::Single(library_back)),
    ("f64, libm", Call::Double(double_back)),
    ("I16F16, `fixed`", Call::Fixed(fixed_back, 16, 16)),
    ("Q16, VSQRT", Call::Fixed(hardware_back, 16, 16)),
    ("Q16 to Q24, u64::isqrt", Call::Fixed(integer_back, 16, 24)),
    ("**Q16 to Q24, Tip::indentation**", Call::Fixed(firmware_back, 16, 24)),
];

extern "C" fn single(d: f32, _: f32, tools: &Tools) -> f32 {
    tools.single.pi_y * d * d
}

extern "C" fn micro(d: f32, _: f32, tools: &Tools) -> f32 {
    tools.single.pi_y * F32Ext::powf(d, 2.0)
}

extern "C" fn double(d: f64, _: f64, tools: &Tools) -> f64 {
    tools.double.pi_y * d * d
}

extern "C" fn fixed_point(d: i32, _: i32, tools: &Tools) -> i32 {
    let d = I16F16::from_bits(d);
    (d * d * tools.fixed.pi_y).to_bits()
}

extern "C" fn saturating(d: i32, _: i32, tools: &Tools) -> i32 {
    let d = I16F16::from_bits(d);
    d.saturating_mul(d).saturating_mul(tools.fixed.pi_y).to_bits()
}

extern "C" fn wide(d: i32, _: i32, tools: &Tools) -> i32 {
    let (d, pi_y) = (I32F32::from_bits(i64::from(d) << 16), I32F32::from_bits(i64::from(tools.pi_y_q30) << 2));
    (d * d * pi_y).to_num::<I16F16>().to_bits()
}

/// Products in 64 bits, rounded once.
extern "C" fn integer(d: i32, _: i32, tools: &Tools) -> i32 {
    // Below 10 mm the square in Q24 fits 32 bits.
    let square_q24 = (u64::from(d as u32) * u64::from(d as u32)) >> 8;
    ((square_q24 * u64::from(tools.pi_y_q30) + (1 << 37)) >> 38) as i32
}

extern "C" fn firmware(d: i32, _: i32, tools: &Tools) -> i32 {
    tools.tip.force(Millimetres::from_bits(d)).to_bits()
}

extern "C" fn single_back(force: f32, _: f32, tools: &Tools) -> f32 {
    hardware(force * tools.single.inverse, 0.0, tools)
}

extern "C" fn micro_back(force: f32, _: f32, tools: &Tools) -> f32 {
    F32Ext::sqrt(force * tools.single.inverse)
}

extern "C" fn library_back(force: f32, _: f32, tools: &Tools) -> f32 {
    libm::sqrtf(force * tools.single.inverse)
}

extern "C" fn double_back(force: f64, _: f64, tools: &Tools) -> f64 {
    libm::sqrt(force * tools.double.inverse)
}

extern "C" fn fixed_back(force: i32, _: i32, tools: &Tools) -> i32 {
    (I16F16::from_bits(force) / tools.fixed.pi_y).sqrt().to_bits()
}

extern "C" fn hardware_back(force: i32, _: i32, tools: &Tools) -> i32 {
    let square = (u64::from(force as u32) * u64::from(tools.inverse_q30)) >> 30;
    hardware_q16(square as i32, 0, tools)
}

extern "C" fn integer_back(force: i32, _: i32, tools: &Tools) -> i32 {
    // Q46 to Q48.
    (u64::from(force as u32) * u64::from(tools.inverse_q30) * 4).isqrt() as i32
}

extern "C" fn firmware_back(force: i32, _: i32, tools: &Tools) -> i32 {
    tools.tip.indentation(Newtons::from_bits(force)).to_bits()
}
