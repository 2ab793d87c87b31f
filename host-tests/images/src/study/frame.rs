//! From a frame to the sums that force and centre are read from, the peak, and whether a taxel is dead or saturated.

use super::Inputs;
use super::call::pass_on;
use crate::host::{fail, say};
use fingertip::shipped::{
    Array, BANK_COLUMNS, COLUMNS, Calibration, Config, Frame, ROWS, SLOTS, TARE_FRAMES, TactileImage,
};
use fixed::types::I16F16;

/// Sums in a format: of the taxels, weighted by -9, -7 .. 9 along the columns and along the rows, and the largest.
#[derive(Clone, Copy, Default)]
pub struct Sums<T> {
    pub sum: T,
    /// Weighted along the columns.
    pub moment_x: T,
    /// Weighted along the rows.
    pub moment_y: T,
    pub peak: T,
}

/// Data that the variants read and write.
pub struct Bench {
    /// The firmware's constants.
    pub config: Config,
    /// The firmware's own reading.
    pub array: Array,
    pub frame: Frame,
    /// Q14, in pairs as the codes are.
    pub gain: [[u32; BANK_COLUMNS]; ROWS],
    /// Tare, sixteenths of a code.
    pub tare: [[i32; COLUMNS]; ROWS],
    pub single: Float<f32>,
    pub double: Float<f64>,
    /// Data in I16F16, unit 32 codes.
    pub fixed: Float<I16F16>,
    /// Results in sixteenths of a code, or finer.
    pub out: Sums<i32>,
    /// Results in codes, single precision.
    pub out_single: Sums<f32>,
    /// Results in codes, double precision.
    pub out_double: Sums<f64>,
    /// True if a taxel is dead or saturated.
    pub suspect: bool,
}

/// Calibration in a format, tare in codes.
pub struct Float<T> {
    pub gain: [[T; COLUMNS]; ROWS],
    pub tare: [[T; COLUMNS]; ROWS],
    pub sag: T,
}

#[derive(Clone, Copy)]
enum Format {
    /// Format of the firmware: sixteenths, in the array's tactile image.
    Picture,
    /// Fractional bits of a code.
    Fixed(u32),
    Single,
    Double,
}

type Kernel = extern "C" fn(&mut Bench);

const VARIANTS: [(&str, Kernel, Format); 5] = [
    ("plain integers", integers, Format::Fixed(4)),
    ("f32", single, Format::Single),
    ("f64", double, Format::Double),
    ("I16F16 saturating, `fixed`", saturating, Format::Fixed(11)),
    ("**Array::read**", firmware, Format::Picture),
];

/// Measures all variants over the next section of inputs: gains, the frame without contact, frames.
#[inline(never)]
pub fn run(region: &mut u32, config: &Config, inputs: &mut Inputs) {
    let [count] = inputs.words();
    let mut bench = bench(config, inputs);
    let start = inputs.place();
    for (name, kernel, format) in VARIANTS {
        say(format_args!("region {region} frame: {name}"));
        inputs.seek(start);
        for _ in 0..count {
            bench.frame = read(inputs);
            pass_on(*region, kernel, &mut bench);
            bench.collect(format);
            if bench.suspect {
                fail("a sound frame is flagged");
            }
            let Bench { out, out_single, out_double, .. } = &bench;
            match format {
                Format::Picture => say(format_args!("i4 {} i4 {} i4 {}", out.sum, out.moment_x, out.moment_y)),
                Format::Fixed(bits) => {
                    say(format_args!("i{bits} {} i{bits} {} i{bits} {}", out.sum, out.moment_x, out.moment_y));
                }
                Format::Single => {
                    let [s, x, y] = [out_single.sum, out_single.moment_x, out_single.moment_y].map(f32::to_bits);
                    say(format_args!("f {s:x} f {x:x} f {y:x}"));
                }
                Format::Double => {
                    let [s, x, y] = [out_double.sum, out_double.moment_x, out_double.moment_y].map(f64::to_bits);
                    say(format_args!("d {s:x} d {x:x} d {y:x}"));
                }
            }
        }
        // What a flag is for: the same frame with a saturated, then with a dead taxel.
        for code in [bench.config.saturated_codes, bench.frame.code(ROWS, 4)] {
            let sound = bench.frame;
            bench.frame.set_code(3, 4, code);
            kernel(&mut bench);
            bench.collect(format);
            if !bench.suspect {
                fail("a bad taxel is not flagged");
            }
            bench.frame = sound;
        }
        *region += 1;
    }
}

impl Bench {
    /// State that the firmware's variant left in the array.
    fn collect(&mut self, format: Format) {
        if let Format::Picture = format {
            let TactileImage { sum, moment_x, moment_y, peak, bad_count, .. } = *self.array.picture();
            self.out = Sums { sum, moment_x, moment_y, peak };
            self.suspect = bad_count > 0;
        }
    }
}

fn read(inputs: &mut Inputs) -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, place) in (0..SLOTS).flat_map(|slot| (0..BANK_COLUMNS).map(move |place| (slot, place))) {
        let [word] = inputs.words();
        frame.set_code(slot, place, word as u16);
        frame.set_code(slot, place + BANK_COLUMNS, (word >> 16) as u16);
    }
    frame
}

fn bench(config: &Config, inputs: &mut Inputs) -> Bench {
    let mut gains = [[0_u16; COLUMNS]; ROWS];
    gains.iter_mut().flatten().for_each(|gain| {
        let [word] = inputs.words();
        *gain = word as u16;
    });
    let quiet = read(inputs);
    let Ok(calibration) = Calibration::new(&gains, &[0; ROWS]) else { fail("the gains are refused") };
    let mut array = Array::new();
    array.calibrate(&calibration);
    for _ in 0..TARE_FRAMES {
        array.read(&quiet, config);
        array.continue_tare();
    }
    let sag = f64::from(config.sag_q32) / 4_294_967_296.0;
    let net = |row, column| i32::from(quiet.code(row, column)) - i32::from(quiet.code(ROWS, column));
    let exact = |row: usize, column: usize| {
        let total: i32 = (0..COLUMNS).map(|column| net(row, column)).sum();
        f64::from(net(row, column)) * f64::from(gains[row][column]) / 16_384.0 / (1.0 - sag * f64::from(total))
    };
    let tare: [[f64; COLUMNS]; ROWS] = core::array::from_fn(|row| core::array::from_fn(|column| exact(row, column)));
    // A power of two above 0, to the nearest.
    let rounded = |value: f64, one: f64| (value * one + 0.5) as i32;
    let gain =
        gains.map(|row| core::array::from_fn(|place| lanes::pair(row[place] as i16, row[place + BANK_COLUMNS] as i16)));
    Bench {
        config: config.clone(),
        frame: quiet,
        gain,
        single: Float {
            gain: gains.map(|row| row.map(|gain| f32::from(gain) / 16_384.0)),
            tare: tare.map(|row| row.map(|tare| tare as f32)),
            sag: sag as f32,
        },
        double: Float { gain: gains.map(|row| row.map(|gain| f64::from(gain) / 16_384.0)), tare, sag },
        fixed: Float {
            gain: gains.map(|row| row.map(|gain| I16F16::from_bits(i32::from(gain) << 2))),
            tare: tare.map(|row| row.map(|tare| I16F16::from_bits(rounded(tare, 2_048.0)))),
            sag: I16F16::from_bits((sag * 32.0 * 65_536.0 + 0.5) as i32),
        },
        array,
        tare: tare.map(|row| row.map(|tare| rounded(tare, 16.0))),
        out: Sums::default(),
        out_single: Sums::default(),
        out_double: Sums::default(),
        suspect: false,
    }
}

extern "C" fn firmware(bench: &mut Bench) {
    bench.array.read(&bench.frame, &bench.config);
}

/// Taxel by taxel, in 32 and 64 bits.
extern "C" fn integers(bench: &mut Bench) {
    let mut out = Sums::<i32>::default();
    let mut bad = 0_u32;
    for row in 0..ROWS {
        let mut nets = [0; COLUMNS];
        let mut total = 0;
        for (column, net) in nets.iter_mut().enumerate() {
            let code = bench.frame.code(row, column);
            *net = (i32::from(code) - i32::from(bench.frame.code(ROWS, column))).max(0);
            bad += u32::from(code >= bench.config.saturated_codes || *net < i32::from(bench.config.dead_codes));
            total += *net;
        }
        // 1 / (1 - rho N) in Q22.
        let remaining = (u32::MAX - (total as u32).saturating_mul(bench.config.sag_q32.into())) >> 16;
        let boost = ((u32::MAX / remaining.max(1 << 15)) << 6) as i32;
        for (column, net) in nets.into_iter().enumerate() {
            let pair = bench.gain[row][column % BANK_COLUMNS];
            let gain = if column < BANK_COLUMNS { lanes::low(pair) } else { lanes::high(pair) };
            let boosted = (i64::from(net * i32::from(gain)) * i64::from(boost) + (1 << 31)) >> 32;
            let value = boosted as i32 - bench.tare[row][column];
            out.sum += value;
            out.moment_x += value * (2 * column as i32 - 9);
            out.moment_y += value * (2 * row as i32 - 9);
            out.peak = out.peak.max(value);
        }
    }
    bench.out = out;
    bench.suspect = bad > 0;
}

macro_rules! floating {
    ($name:ident, $type:ty, $constants:ident, $out:ident) => {
        pub extern "C" fn $name(bench: &mut Bench) {
            let mut out = Sums::<$type>::default();
            let mut bad = 0_u32;
            for row in 0..ROWS {
                let mut nets = [0.0; COLUMNS];
                let mut total = 0.0;
                for (column, net) in nets.iter_mut().enumerate() {
                    let code = bench.frame.code(row, column);
                    let above = i32::from(code) - i32::from(bench.frame.code(ROWS, column));
                    bad +=
                        u32::from(code >= bench.config.saturated_codes || above < i32::from(bench.config.dead_codes));
                    *net = <$type>::from(above as i16);
                    total += *net;
                }
                let boost = 1.0 / (1.0 - bench.$constants.sag * total);
                for (column, net) in nets.into_iter().enumerate() {
                    let value = net * bench.$constants.gain[row][column] * boost - bench.$constants.tare[row][column];
                    out.sum += value;
                    out.moment_x += value * <$type>::from(2 * column as i16 - 9);
                    out.moment_y += value * <$type>::from(2 * row as i16 - 9);
                    if value > out.peak {
                        out.peak = value;
                    }
                }
            }
            bench.$out = out;
            bench.suspect = bad > 0;
        }
    };
}
floating!(single, f32, single, out_single);
floating!(double, f64, double, out_double);

pub extern "C" fn saturating(bench: &mut Bench) {
    let mut out = Sums::<I16F16>::default();
    let mut bad = 0_u32;
    for row in 0..ROWS {
        let mut nets = [I16F16::ZERO; COLUMNS];
        let mut total = I16F16::ZERO;
        for (column, net) in nets.iter_mut().enumerate() {
            let code = bench.frame.code(row, column);
            let above = i32::from(code).saturating_sub(i32::from(bench.frame.code(ROWS, column))).max(0);
            bad += u32::from(code >= bench.config.saturated_codes || above < i32::from(bench.config.dead_codes));
            *net = I16F16::from_bits(above << 11);
            total = total.saturating_add(*net);
        }
        let remaining = I16F16::ONE.saturating_sub(bench.fixed.sag.saturating_mul(total));
        let boost = I16F16::ONE.saturating_div(remaining.max(I16F16::DELTA));
        for (column, net) in nets.into_iter().enumerate() {
            let value = net.saturating_mul(bench.fixed.gain[row][column]).saturating_mul(boost);
            let value = value.saturating_sub(bench.fixed.tare[row][column]);
            out.sum = out.sum.saturating_add(value);
            out.moment_x = out.moment_x.saturating_add(value.saturating_mul_int(2 * column as i32 - 9));
            out.moment_y = out.moment_y.saturating_add(value.saturating_mul_int(2 * row as i32 - 9));
            out.peak = out.peak.max(value);
        }
    }
    let Sums { sum, moment_x, moment_y, peak } = out;
    let [sum, moment_x, moment_y, peak] = [sum, moment_x, moment_y, peak].map(I16F16::to_bits);
    bench.out = Sums { sum, moment_x, moment_y, peak };
    bench.suspect = bad > 0;
}
