//! Ways to take a square root.

use super::scalar::{Call, Tools, Variant, variant};
use core::arch::naked_asm;
use fingertip::arith::floor_sqrt;
use fixed::types::I16F16;
use micromath::F32Ext;

/// All of them.
pub const VARIANTS: &[Variant] = &[
    ("f32, VSQRT", Call::Single(hardware)),
    variant!("f32, micromath", Single f32: |x, _, _| F32Ext::sqrt(x)),
    variant!("f32, libm", Single f32: |x, _, _| libm::sqrtf(x)),
    variant!("f64, libm", Double f64: |x, _, _| libm::sqrt(x)),
    variant!("I16F16, `fixed`", Fixed i32, 16, 16: |x, _, _| I16F16::from_bits(x).sqrt().to_bits()),
    variant!("Q16, u64::isqrt", Fixed i32, 16, 16: |x, _, _| (u64::from(x as u32) << 16).isqrt() as i32),
    variant!("Q16 to Q8, u32::isqrt", Fixed i32, 16, 8: |x, _, _| (x as u32).isqrt() as i32),
    ("Q16, VCVT and VSQRT", Call::Fixed(hardware_q16, 16, 16)),
    ("Q16, table of 193", Call::Fixed(table, 16, 16)),
    ("**u64 to u32, floor_sqrt**", Call::Wide(firmware, 48, 24)),
];

/// The instruction.
#[unsafe(naked)]
pub extern "C" fn hardware(x: f32, _: f32, _: &Tools) -> f32 {
    naked_asm!("vsqrt.f32 s0, s0", "bx lr")
}

/// The instruction between conversions from and to Q16.
#[unsafe(naked)]
pub extern "C" fn hardware_q16(x: i32, _: i32, _: &Tools) -> i32 {
    naked_asm!(
        "vmov s0, r0",
        "vcvt.f32.s32 s0, s0, #16",
        "vsqrt.f32 s0, s0",
        "vcvt.s32.f32 s0, s0, #16",
        "vmov r0, s0",
        "bx lr"
    )
}

/// sqrt(n / 64) in Q24 for n from 64 to 256.
static TABLE: [u32; 193] = {
    let mut table = [0; 193];
    let mut n = 0;
    while n < 193 {
        table[n] = ((n as u64 + 64) << 42).isqrt() as u32;
        n += 1;
    }
    table
};

/// A root of a number shifted into [2^30, 2^32) by the table's chord.
extern "C" fn table(x: i32, _: i32, _: &Tools) -> i32 {
    let x = x as u32;
    if x == 0 {
        return 0;
    }
    let shift = x.leading_zeros() & !1;
    let x = x << shift;
    let place = (x >> 24) as usize - 64;
    let (Some(low), Some(high)) = (TABLE.get(place), TABLE.get(place + 1)) else { return 0 };
    let part = x >> 9 & 0x7fff;
    let root = low + (((high - low) * part) >> 15);
    // x in units of 2^30 has its root in Q24; Q16 of x is 2^14 of these, whose root is 2^7.
    (root >> (shift / 2 + 1)) as i32
}

extern "C" fn firmware(x: u64, _: &Tools) -> u32 {
    floor_sqrt(x)
}
