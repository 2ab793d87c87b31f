//! Instructions of Cortex-M cores that stable Rust offers only as assembly: two signed 16-bit numbers in a word, worked
//! on at once, and the FPU's square root.
//!
//! On every other core each function is portable Rust ([`portable`]) and gives the same bits. The build script chooses:
//!
//! - DSP instructions: on `thumbv7em-*`, and on `thumbv8m.main-*` where the flags name a core that has them
//!   (`-C target-cpu=cortex-m33`) or the feature (`-C target-feature=+dsp`);
//! - the FPU's square root: on the M profile's targets that end with `eabihf`.
//!
//! This crate is the only place outside the board layer with `unsafe`: the core forbids it. A test compares the portable
//! functions with plain arithmetic on any host, and digests of emulated cores compare the instructions with the portable
//! functions.
#![no_std]

#[cfg(not(target_os = "none"))]
#[cfg_attr(test, macro_use)]
extern crate std;

mod rows;

pub use rows::{
    BOOST_BITS, CODE_BITS, Codes, Common, Curve, GAIN_BITS, Row, TARE_BITS, Total, codes_at, each_pair, filled,
    moment_bits, pairs, pass, place, portable_pass, sum_drop,
};

/// True if this build uses the DSP instructions.
pub const DSP: bool = cfg!(dsp);

/// True if this build uses the FPU's square root.
pub const FPU: bool = cfg!(fpu);

/// The sign bits of both lanes.
pub const SIGNS: u32 = 0x8000_8000;

/// Two numbers side by side.
///
/// ```
/// assert_eq!(lanes::pair(1, -1), 0xffff_0001);
/// ```
#[inline(always)]
pub const fn pair(low: i16, high: i16) -> u32 {
    low as u16 as u32 | (high as u16 as u32) << 16
}

/// The number in the low half.
#[inline(always)]
pub const fn low(pair: u32) -> i16 {
    pair as i16
}

/// The number in the high half.
#[inline(always)]
pub const fn high(pair: u32) -> i16 {
    (pair >> 16) as i16
}

/// The larger in each lane, both unsigned.
#[inline(always)]
pub fn larger(a: u32, b: u32) -> u32 {
    // No lane carries: the sum is one of the two.
    a.wrapping_add(excess(b, a))
}

/// The same functions without the instructions.
pub mod portable {
    use super::{high, low, pair};

    /// See [`super::sub`].
    #[inline(always)]
    pub const fn sub(a: u32, b: u32) -> u32 {
        pair(low(a).wrapping_sub(low(b)), high(a).wrapping_sub(high(b)))
    }

    /// See [`super::excess`].
    #[inline(always)]
    pub const fn excess(a: u32, b: u32) -> u32 {
        let above = [(a as u16).saturating_sub(b as u16), ((a >> 16) as u16).saturating_sub((b >> 16) as u16)];
        above[0] as u32 | (above[1] as u32) << 16
    }

    /// See [`super::dot`].
    #[inline(always)]
    pub const fn dot(a: u32, b: u32, sum: i32) -> i32 {
        let products = [low(a) as i32 * low(b) as i32, high(a) as i32 * high(b) as i32];
        sum.wrapping_add(products[0]).wrapping_add(products[1])
    }

    /// See [`super::add_high`].
    #[inline(always)]
    pub const fn add_high(sum: i32, a: i32, b: i32) -> i32 {
        sum.wrapping_add(((a as i64 * b as i64) >> 32) as i32)
    }

    /// Square root in single precision, rounded to nearest: with `libm` where there is neither `std` nor an FPU.
    #[cfg(not(target_os = "none"))]
    #[inline(always)]
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }
    #[cfg(all(target_os = "none", not(fpu)))]
    use libm::sqrtf as sqrt;

    /// See [`super::near_root`].
    #[cfg(not(fpu))]
    #[inline(always)]
    pub fn near_root(x: u32) -> u32 {
        // Each operation is rounded as IEEE 754 demands, as on the target; the scale is a power of two.
        (sqrt(x as f32) * 65_536.0) as u32
    }

    /// See [`super::root_and_product`].
    #[cfg(not(fpu))]
    #[inline(always)]
    pub fn root_and_product(x: u32, y: u32, gain: u64) -> (u32, u64) {
        (sqrt(x as f32 * y as f32) as u32, u64::from(x).wrapping_mul(gain))
    }
}

#[cfg(dsp)]
pub use dsp::{add_high, dot, excess, sub};
#[cfg(fpu)]
pub use fpu::{near_root, root_and_product};
#[cfg(not(dsp))]
pub use portable::{add_high, dot, excess, sub};
#[cfg(not(fpu))]
pub use portable::{near_root, root_and_product};

#[cfg(dsp)]
mod dsp {
    use core::arch::asm;

    /// Makes a function of an instruction.
    macro_rules! instruction {
        ($doc:literal $name:ident($($operand:ident: $number:ty),+) -> $result:ty, $code:literal) => {
            #[doc = $doc]
            #[inline(always)]
            pub fn $name($($operand: $number),+) -> $result {
                let result;
                // SAFETY: reads and writes registers only. The flags that it can set (GE, and Q, which is sticky) are
                // read by no other instruction here.
                unsafe { asm!($code, lateout(reg) result, $(in(reg) $operand),+, options(pure, nomem, nostack)) }
                result
            }
        };
    }

    instruction!("a - b in each lane, wrapping (SSUB16)." sub(a: u32, b: u32) -> u32, "ssub16 {}, {}, {}");
    instruction!("a - b in each lane, both unsigned, and 0 where b is larger (UQSUB16)."
        excess(a: u32, b: u32) -> u32, "uqsub16 {}, {}, {}");
    instruction!("sum + a.low b.low + a.high b.high, wrapping (SMLAD)."
        dot(a: u32, b: u32, sum: i32) -> i32, "smlad {}, {}, {}, {}");
    instruction!("sum + the upper half of a b, wrapping (SMMLA)."
        add_high(sum: i32, a: i32, b: i32) -> i32, "smmla {0}, {2}, {3}, {1}");
}

#[cfg(fpu)]
mod fpu {
    use core::arch::asm;

    /// sqrt(x) in Q16, saturated, to within 2^-23 of itself for x from 2^30 (VSQRT, in single precision).
    #[inline(always)]
    pub fn near_root(x: u32) -> u32 {
        let root;
        // SAFETY: reads and writes registers only; s0 is named as changed. The FPU's sticky flags are read nowhere.
        unsafe {
            asm!(
                "vmov s0, {x}",
                "vcvt.f32.u32 s0, s0",
                "vsqrt.f32 s0, s0",
                "vcvt.u32.f32 s0, s0, #16",
                "vmov {x}, s0",
                x = inlateout(reg) x => root, out("s0") _, options(pure, nomem, nostack),
            );
        }
        root
    }

    /// sqrt(x y), to within 2.5 x 2^-24 of itself and rounded down to an integer (VMUL and VSQRT, in single precision);
    /// and x times the gain, the last 64 bits (UMULL and MLA), which costs nothing while the FPU takes the root.
    #[inline(always)]
    pub fn root_and_product(x: u32, y: u32, gain: u64) -> (u32, u64) {
        let (root, low, high): (u32, u32, u32);
        // SAFETY: as above, with s1.
        unsafe {
            asm!(
                "vmov s0, s1, {x}, {y}",
                "vcvt.f32.u32 s0, s0",
                "vcvt.f32.u32 s1, s1",
                "vmul.f32 s0, s0, s1",
                "vsqrt.f32 s0, s0",
                "umull {low}, {y}, {x}, {low}",
                "mla {high}, {x}, {high}, {y}",
                "vcvt.u32.f32 s0, s0",
                "vmov {x}, s0",
                x = inlateout(reg) x => root, y = inlateout(reg) y => _,
                low = inlateout(reg) gain as u32 => low, high = inlateout(reg) (gain >> 32) as u32 => high,
                out("s0") _, out("s1") _, options(pure, nomem, nostack),
            );
        }
        (root, u64::from(high) << 32 | u64::from(low))
    }
}

#[cfg(test)]
#[path = "../build.rs"]
#[expect(dead_code, reason = "cargo calls main")]
mod build;

#[cfg(test)]
mod tests {
    use super::{build, portable};

    #[test]
    fn dsp_instructions_are_used_where_target_or_flags_show_them() {
        let has = |target: &str, flags: &[&str]| build::has_dsp(target, "", &flags.join("\x1f"));
        assert!(has("thumbv7em-none-eabi", &[]) && has("thumbv7em-none-eabihf", &["-C", "opt-level=s"]));
        for target in ["thumbv6m-none-eabi", "thumbv7m-none-eabi", "thumbv8m.main-none-eabihf"] {
            assert!(!has(target, &[]), "{target}");
        }
        let m33 = "thumbv8m.main-none-eabi";
        for flags in [
            &["-C", "target-cpu=cortex-m33"][..],
            &["-Ctarget-cpu=cortex-m33"],
            &["--codegen=target-cpu=cortex-m33"],
            &["-C", "target-feature=+dsp"],
            &["-C", "target-cpu=cortex-m3", "-Ctarget-cpu=cortex-m55"],
        ] {
            assert!(has(m33, flags), "{flags:?}");
        }
        assert!(!has(m33, &["-C", "target-cpu=cortex-m33", "-C", "target-feature=+fp-armv8,-dsp"]));
        assert!(!has(m33, &["-C", "target-cpu=cortex-m33", "-C", "target-cpu=cortex-m3"]));
        assert!(!has("thumbv6m-none-eabi", &["-C", "target-cpu=cortex-m4"]));
        assert!(!has("thumbv7a-none-eabi", &["-C", "target-feature=+dsp"]));
        assert!(build::has_dsp(m33, "dsp,mclass", ""));
    }

    #[test]
    fn libm_gives_the_same_roots_as_std() {
        // The mantissa of a root depends on the mantissa and on the lowest bit of the exponent: all of these.
        let all = 0x3f80_0000..0x4080_0000;
        // And every exponent of a product, with the mantissas at both ends.
        let exponents = (127..192).flat_map(|exponent| [exponent << 23, (exponent << 23) + 1, (exponent << 23) - 1]);
        for x in all.chain(exponents).chain([0]).map(f32::from_bits) {
            assert_eq!(libm::sqrtf(x).to_bits(), x.sqrt().to_bits(), "{x}");
        }
    }

    #[test]
    fn the_near_root_is_near() {
        let mut worst = 0.0_f64;
        for x in (1 << 30..=u32::MAX).step_by(65_537).chain([u32::MAX]) {
            let exact = f64::from(x).sqrt() * 65_536.0;
            worst = worst.max((f64::from(portable::near_root(x)) - exact).abs() / exact.max(1.0));
        }
        assert!(worst < 1.0 / 8_388_608.0 && worst > 1.0 / 33_554_432.0, "{worst:e}");
        assert_eq!(portable::near_root(u32::MAX), u32::MAX, "saturated");
    }

    #[test]
    fn the_root_of_a_product_is_near_and_the_product_exact() {
        let unit = 1.0 / 16_777_216.0;
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for x in (1 << 30..=u32::MAX).step_by(6_555_537).chain([u32::MAX]) {
            for y in (1 << 26..=u32::MAX).step_by(6_550_537).chain([u32::MAX]) {
                let exact = (f64::from(x) * f64::from(y)).sqrt();
                let (root, product) = portable::root_and_product(x, y, u64::from(y) << 20);
                high = high.max((f64::from(root) - exact) / exact);
                low = low.max((exact - f64::from(root) - 1.0) / exact);
                assert_eq!(product, (u64::from(x) * u64::from(y)) << 20);
            }
        }
        assert!(low.max(high) < 2.5 * unit && low.min(high) > unit, "{low:e} {high:e}");
        let roots = [(0, 9), (9, 0), (3, 3), (3, 5)].map(|(x, y)| portable::root_and_product(x, y, 0).0);
        assert_eq!(roots, [0, 0, 3, 3]);
    }
}
