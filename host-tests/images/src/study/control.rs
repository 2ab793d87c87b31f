//! A controller's step: proportional and integral by increments, its output held to a range and to a slew.
//!
//! y = y1 + (k_p + k_i) e - k_p e1, within 1 either way and within `SLEW` of y1. The cut part never enters y1, so
//! nothing winds up.

use super::Inputs;
use super::call::pass_on;
use crate::host::say;
use dsp_process::SplitProcess;
use fixed::types::I16F16;
use idsp::iir::{Biquad, BiquadClamp, DirectForm1};

const KP: f64 = 1.53;
const KI: f64 = 0.061;
const SLEW: f64 = 0.03;

/// Fractional bits of the biquad's coefficients.
const BITS: i8 = 24;
type Coefficient = dsp_fixedpoint::Q<i32, i64, BITS>;

/// Data that the variants read and write.
struct Bench {
    error: i32,
    error_single: f32,
    error_double: f64,
    state: [i32; 2],
    state_single: [f32; 2],
    state_double: [f64; 2],
    biquad: BiquadClamp<Coefficient, i32>,
    biquad_state: DirectForm1<i32>,
    float_biquad: BiquadClamp<f32>,
    float_state: DirectForm1<f32>,
}

#[derive(Clone, Copy)]
enum Out {
    Fixed(u32),
    Single,
    Double,
    Biquad,
    FloatBiquad,
}

type Kernel = extern "C" fn(&mut Bench);

const VARIANTS: [(&str, Kernel, Out); 7] = [
    ("Q16, integers", q16, Out::Fixed(16)),
    ("Q30, integers", q30, Out::Fixed(30)),
    ("I16F16 saturating, `fixed`", saturating, Out::Fixed(16)),
    ("f32", single, Out::Single),
    ("f64", double, Out::Double),
    ("Q30, idsp biquad", biquad, Out::Biquad),
    ("f32, idsp biquad", float_biquad, Out::FloatBiquad),
];

/// Measures all variants over the next section of errors, in Q16.
#[inline(never)]
pub fn run(region: &mut u32, inputs: &mut Inputs) {
    let [count] = inputs.words();
    let start = inputs.place();
    let ba = [KP + KI, -KP, 0.0, 1.0, 0.0];
    for (name, kernel, out) in VARIANTS {
        say(format_args!("region {region} control: {name}"));
        inputs.seek(start);
        let scale = f64::from(1 << BITS);
        let coefficients = ba.map(|value| Coefficient::from_bits(rounded(value * scale)));
        let mut bench = Bench {
            error: 0,
            error_single: 0.0,
            error_double: 0.0,
            state: [0; 2],
            state_single: [0.0; 2],
            state_double: [0.0; 2],
            biquad: BiquadClamp::from(Biquad { ba: coefficients }),
            biquad_state: DirectForm1::default(),
            float_biquad: BiquadClamp::from(Biquad { ba: ba.map(|value| value as f32) }),
            float_state: DirectForm1::default(),
        };
        for _ in 0..count {
            let [error, _] = inputs.words();
            bench.error_single = error as f32 / 65_536.0;
            bench.error_double = f64::from(error) / 65_536.0;
            bench.error = if matches!(out, Out::Fixed(30) | Out::Biquad) { error << 14 } else { error };
            pass_on(*region, kernel, &mut bench);
            match out {
                Out::Fixed(bits) => say(format_args!("i{bits} {}", bench.state[1])),
                Out::Single => say(format_args!("f {:x}", bench.state_single[1].to_bits())),
                Out::Double => say(format_args!("d {:x}", bench.state_double[1].to_bits())),
                Out::Biquad => say(format_args!("i30 {}", bench.biquad_state.y0())),
                Out::FloatBiquad => say(format_args!("f {:x}", bench.float_state.y0().to_bits())),
            }
        }
        *region += 1;
    }
}

const fn rounded(value: f64) -> i32 {
    (if value < 0.0 { value - 0.5 } else { value + 0.5 }) as i32
}

/// Clamps to two bounds by comparisons: `max` and `min` would call a function to handle NaN.
#[inline(always)]
fn held<T: PartialOrd>(value: T, low: T, high: T) -> T {
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}

extern "C" fn q16(bench: &mut Bench) {
    const GAINS: [i32; 2] = [rounded((KP + KI) * 65_536.0), rounded(KP * 65_536.0)];
    const LIMITS: [i32; 2] = [1 << 16, rounded(SLEW * 65_536.0)];
    let [before, y] = bench.state;
    let more = i64::from(GAINS[0]) * i64::from(bench.error) - i64::from(GAINS[1]) * i64::from(before);
    let more = ((more + (1 << 15)) >> 16) as i32;
    let y = (y + more.max(-LIMITS[1]).min(LIMITS[1])).max(-LIMITS[0]).min(LIMITS[0]);
    bench.state = [bench.error, y];
}

extern "C" fn q30(bench: &mut Bench) {
    // Errors and outputs in Q30, gains in Q24.
    const GAINS: [i32; 2] = [rounded((KP + KI) * 16_777_216.0), rounded(KP * 16_777_216.0)];
    const LIMITS: [i32; 2] = [1 << 30, rounded(SLEW * 1_073_741_824.0)];
    let [before, y] = bench.state;
    let more = i64::from(GAINS[0]) * i64::from(bench.error) - i64::from(GAINS[1]) * i64::from(before);
    let more = (more >> 24).max(i64::from(-LIMITS[1])).min(i64::from(LIMITS[1])) as i32;
    bench.state = [bench.error, (y + more).max(-LIMITS[0]).min(LIMITS[0])];
}

extern "C" fn saturating(bench: &mut Bench) {
    const GAINS: [I16F16; 2] = [I16F16::lit("1.591"), I16F16::lit("1.53")];
    const SLEW: I16F16 = I16F16::lit("0.03");
    let [error, before, y] = [bench.error, bench.state[0], bench.state[1]].map(I16F16::from_bits);
    let more = GAINS[0].saturating_mul(error).saturating_sub(GAINS[1].saturating_mul(before));
    let y = y.saturating_add(more.max(-SLEW).min(SLEW)).max(-I16F16::ONE).min(I16F16::ONE);
    bench.state = [bench.error, y.to_bits()];
}

extern "C" fn single(bench: &mut Bench) {
    const SLEW_SINGLE: f32 = SLEW as f32;
    let [before, y] = bench.state_single;
    let more = (KP + KI) as f32 * bench.error_single - KP as f32 * before;
    let y = held(y + held(more, -SLEW_SINGLE, SLEW_SINGLE), -1.0, 1.0);
    bench.state_single = [bench.error_single, y];
}

extern "C" fn double(bench: &mut Bench) {
    let [before, y] = bench.state_double;
    let more = (KP + KI) * bench.error_double - KP * before;
    let y = held(y + held(more, -SLEW, SLEW), -1.0, 1.0);
    bench.state_double = [bench.error_double, y];
}

/// The slew by moving the clamp.
extern "C" fn biquad(bench: &mut Bench) {
    const LIMITS: [i32; 2] = [1 << 30, rounded(SLEW * 1_073_741_824.0)];
    let y = bench.biquad_state.y0();
    bench.biquad.min = (y - LIMITS[1]).max(-LIMITS[0]);
    bench.biquad.max = (y + LIMITS[1]).min(LIMITS[0]);
    bench.biquad.process(&mut bench.biquad_state, bench.error);
}

/// The same in single precision.
extern "C" fn float_biquad(bench: &mut Bench) {
    let y = bench.float_state.y0();
    bench.float_biquad.min = held(y - SLEW as f32, -1.0, 1.0);
    bench.float_biquad.max = held(y + SLEW as f32, -1.0, 1.0);
    bench.float_biquad.process(&mut bench.float_state, bench.error_single);
}
