//! The pass over a frame in other formats, taxel by taxel.

use super::frame::{Bench, Sums};
use fingertip::shipped::{COLUMNS, ROWS};
use fixed::types::I16F16;

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
