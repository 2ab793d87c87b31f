//! Equation 14 as a sum over rings, by the midpoint rule in r and in u = r^2, against the closed form.

use super::number::Number;
use super::pressure::{sound, strain, textbook};
use super::scalar::{Call, Tools, Variant, variant};
use core::num::NonZeroU16;
use fingertip::units::Millimetres;
use fixed::types::I16F16;

macro_rules! variants {
    ($($rings:literal)*) => { &[
        variant!("f32, closed form", Single f32: |d, _, tools| tools.single.pi_y * d * d),
        variant!("**Tip::force, closed form**", Fixed i32, 24, 16: |d, _, tools| {
            tools.tip.force(Millimetres::from_bits(d)).to_bits()
        }),
        $(
            variant!(concat!("f32, r, ", $rings), Single f32: |d, _, tools| in_r::<_, $rings>(d, tools)),
            variant!(concat!("f32, u, ", $rings), Single f32: |d, _, tools| in_u::<_, $rings>(d, tools)),
            (concat!("`fixed`, r, ", $rings), Call::Fixed(fixed_r::<$rings>, 16, 16)),
            (concat!("`fixed`, u, ", $rings), Call::Fixed(fixed_u::<$rings>, 16, 16)),
            (concat!("Q16, u, ", $rings), Call::Fixed(integers_u::<$rings>, 16, 16)),
            variant!(concat!("f64, r, ", $rings), Double f64: |d, _, tools| in_r::<_, $rings>(d, tools)),
            variant!(concat!("f64, u, ", $rings), Double f64: |d, _, tools| in_u::<_, $rings>(d, tools)),
            (concat!("Tip, u, ", $rings), Call::Fixed(firmware_u::<$rings>, 24, 16)),
        )*
    ] };
}

/// All of them.
pub const VARIANTS: &[Variant] = variants!(4 8 16 32 64);

/// sum of p(r) 2 pi r dr.
#[inline(always)]
fn in_r<T: Number, const N: u16>(d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let rim = (d * (tip.radius + tip.radius - d)).root();
    let half = rim / T::from_small(2 * N);
    let mut sum = T::from_small(0);
    for ring in 0..N {
        let r = half * T::from_small(2 * ring + 1);
        sum = sum + sound(r * r, d, tools) * r;
    }
    // dr is two halves.
    sum * tip.pi * half * T::from_small(4)
}

/// sum of p(sqrt(u)) pi du.
#[inline(always)]
fn in_u<T: Number, const N: u16>(d: T, tools: &Tools) -> T {
    let tip = T::constants(tools);
    let half = d * (tip.radius + tip.radius - d) / T::from_small(2 * N);
    let mut sum = T::from_small(0);
    for ring in 0..N {
        sum = sum + sound(half * T::from_small(2 * ring + 1), d, tools);
    }
    sum * tip.pi * (half + half)
}

extern "C" fn fixed_r<const N: u16>(d: i32, _: i32, tools: &Tools) -> i32 {
    let (d, tip) = (I16F16::from_bits(d), &tools.fixed);
    let rim = (d * (tip.radius + tip.radius - d)).sqrt();
    let half = rim / I16F16::from_small(2 * N);
    let mut sum = I16F16::ZERO;
    for ring in 0..N {
        let r = half * I16F16::from_small(2 * ring + 1);
        sum += textbook(r * r, d, tools) * r;
    }
    (sum * tip.pi * half * I16F16::from_small(4)).to_bits()
}

extern "C" fn fixed_u<const N: u16>(d: i32, _: i32, tools: &Tools) -> i32 {
    let (d, tip) = (I16F16::from_bits(d), &tools.fixed);
    let half = d * (tip.radius + tip.radius - d) / I16F16::from_small(2 * N);
    let mut sum = I16F16::ZERO;
    for ring in 0..N {
        sum += textbook(half * I16F16::from_small(2 * ring + 1), d, tools);
    }
    (sum * tip.pi * (half + half)).to_bits()
}

extern "C" fn integers_u<const N: u16>(d: i32, _: i32, tools: &Tools) -> i32 {
    let diameter = 2 * tools.fixed.radius.to_bits();
    let rim = ((i64::from(d) * i64::from(diameter - d)) >> 16) as i32;
    let mut sum_q32 = 0_u64;
    for ring in 0..i32::from(N) {
        let (quotient, shift) = strain(rim * (2 * ring + 1) / (2 * i32::from(N)), d, tools);
        sum_q32 += u64::from(quotient) << 1 << (31 - shift);
    }
    // pi Y times the rim's square times the mean strain.
    let mean_q30 = (sum_q32 / u64::from(N)) >> 2;
    let area_q24 = (mean_q30 * rim as u64) >> 22;
    ((area_q24 * u64::from(tools.pi_y_q30)) >> 38) as i32
}

extern "C" fn firmware_u<const N: u16>(d: i32, _: i32, tools: &Tools) -> i32 {
    let Some(rings) = NonZeroU16::new(N) else { return 0 };
    tools.tip.force_by_rings(Millimetres::from_bits(d), rings).to_bits()
}
