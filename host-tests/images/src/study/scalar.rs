//! Kernels of one or two numbers: the same inputs for every variant, each in the variant's own format.

use super::Inputs;
use super::call::{Registers, pass};
use crate::host::say;
use core::arch::naked_asm;
use core::ops::{Add, Div, Mul, Sub};
use fingertip::arith::floor_sqrt;
use fingertip::model::Tip;
use fingertip::shipped::Config;
use fixed::types::I16F16;
use micromath::F32Ext;

/// Fractional bits of the inputs; they have at most 24 significant bits, so every format holds them exactly.
const INPUT_BITS: u32 = 16;

/// The tip in a format: a in mm, Y in N/mm^2.
pub struct Constants<T> {
    pub radius: T,
    /// Young's modulus Y.
    pub modulus: T,
    pub pi_y: T,
    /// 1 / (pi Y).
    pub inverse: T,
}

/// RAM of a variant.
pub struct Tools {
    pub tip: Tip,
    pub single: Constants<f32>,
    /// Constants in double precision, computed by software.
    pub double: Constants<f64>,
    /// Constants in Q16.
    pub fixed: Constants<I16F16>,
    /// pi Y in Q30.
    pub pi_y_q30: u32,
    /// 1 / (pi Y) in Q30.
    pub inverse_q30: u32,
}

impl Tools {
    /// Constants of the firmware's default tip.
    pub fn new(config: &Config) -> Self {
        let (radius, modulus, pi) = (10.0_f64, 0.25_f64, core::f64::consts::PI);
        let (pi_y, inverse) = (pi * modulus, 1.0 / (pi * modulus));
        let q16 = |value: f64| I16F16::from_bits((value * 65_536.0 + 0.5) as i32);
        Self {
            tip: config.tip,
            single: Constants {
                radius: radius as f32,
                modulus: modulus as f32,
                pi_y: pi_y as f32,
                inverse: inverse as f32,
            },
            double: Constants { radius, modulus, pi_y, inverse },
            fixed: Constants { radius: q16(radius), modulus: q16(modulus), pi_y: q16(pi_y), inverse: q16(inverse) },
            pi_y_q30: (pi_y * (1_u32 << 30) as f64 + 0.5) as u32,
            inverse_q30: (inverse * (1_u32 << 30) as f64 + 0.5) as u32,
        }
    }
}

/// The FPU's root, for use inside other kernels.
#[inline(always)]
pub fn root_f32(x: f32) -> f32 {
    let bits: u32;
    // SAFETY: reads and writes registers only. s0 is put back, as stable Rust cannot name it as used on this target.
    unsafe {
        core::arch::asm!(
            "vmov {kept}, s0", "vmov s0, {x}", "vsqrt.f32 s0, s0", "vmov {x}, s0", "vmov s0, {kept}",
            x = inlateout(reg) x.to_bits() => bits, kept = out(reg) _, options(pure, nomem, nostack),
        );
    }
    f32::from_bits(bits)
}

/// Name of a variant: fractional bits before and after if it is fixed-point.
#[derive(Clone, Copy)]
pub enum Call {
    /// In 32 bits.
    Fixed(extern "C" fn(i32, i32, &Tools) -> i32, u32, u32),
    /// Fixed point, from 64 bits to 32.
    Wide(extern "C" fn(u64, &Tools) -> u32, u32, u32),
    Single(extern "C" fn(f32, f32, &Tools) -> f32),
    Double(extern "C" fn(f64, f64, &Tools) -> f64),
}

/// Makes a variant whose kernel is written as a closure: `variant!("f32", Single f32: |x, y, tools| ...)`. In fixed
/// point the fractional bits before and after come with it.
macro_rules! variant {
    ($name:expr, $call:ident $number:ty $(, $from:literal, $to:literal)?: |$x:pat_param, $y:pat_param, $tools:pat_param|
        $body:expr) => {{
        extern "C" fn kernel($x: $number, $y: $number, $tools: &Tools) -> $number {
            $body
        }
        ($name, Call::$call(kernel $(, $from, $to)?))
    }};
}
pub(super) use variant;

pub type Variant = (&'static str, Call);

/// Measures all variants of a kernel over the next section of inputs; the regions count on from `region`.
#[inline(never)]
pub fn run(kernel: &str, variants: &[Variant], region: &mut u32, tools: &Tools, inputs: &mut Inputs) {
    let [count] = inputs.words();
    let start = inputs.place();
    for (name, call) in variants {
        say(format_args!("region {region} {kernel}: {name}"));
        inputs.seek(start);
        for _ in 0..count {
            let input = inputs.words();
            measure(*region, *call, input, tools);
        }
        *region += 1;
    }
}

fn measure(region: u32, call: Call, [x, y]: [i32; 2], tools: &Tools) {
    let tools = &raw const *tools as u32;
    let mut registers = Registers::default();
    let double = |value: i32| {
        let bits = (f64::from(value) / 65_536.0).to_bits();
        [bits as u32, (bits >> 32) as u32]
    };
    let single = |value: i32| (value as f32 / 65_536.0).to_bits();
    let kernel = match call {
        Call::Fixed(kernel, from, _) => {
            let fixed = |value: i32| {
                if from < INPUT_BITS { value >> (INPUT_BITS - from) } else { value << (from - INPUT_BITS) }
            };
            registers.core = [fixed(x) as u32, fixed(y) as u32, tools, 0];
            kernel as *const ()
        }
        Call::Wide(kernel, from, _) => {
            let x = (x as u64) << (from - INPUT_BITS);
            registers.core = [x as u32, (x >> 32) as u32, tools, 0];
            kernel as *const ()
        }
        Call::Single(kernel) => {
            registers.core = [tools, 0, 0, 0];
            registers.single = [single(x), single(y), 0, 0];
            kernel as *const ()
        }
        Call::Double(kernel) => {
            let ([x0, x1], [y0, y1]) = (double(x), double(y));
            registers.core = [tools, 0, 0, 0];
            registers.single = [x0, x1, y0, y1];
            kernel as *const ()
        }
    };
    pass(region, kernel, &mut registers);
    let Registers { core, single } = registers;
    match call {
        Call::Fixed(_, _, to) => say(format_args!("i{to} {}", core[0] as i32)),
        Call::Wide(_, _, to) => say(format_args!("i{to} {}", core[0])),
        Call::Single(_) => say(format_args!("f {:x}", single[0])),
        Call::Double(_) => say(format_args!("d {:x}", u64::from(single[1]) << 32 | u64::from(single[0]))),
    }
}

pub trait Number:
    Copy + Default + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    fn root(self) -> Self;
    fn constants(tools: &Tools) -> &Constants<Self>;
}

impl Number for f32 {
    #[inline(always)]
    fn root(self) -> Self {
        root_f32(self)
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.single
    }
}

impl Number for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        libm::sqrt(self)
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.double
    }
}

impl Number for I16F16 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.fixed
    }
}

pub const ROOT: &[Variant] = &[
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
