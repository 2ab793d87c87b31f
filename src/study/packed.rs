//! A frame's sums two taxels an instruction, without a reading of each taxel.
//!
//! A row's sag is common to its taxels, so it may be taken out of the row's sums instead of each taxel.

use super::frame::{Bench, Sums};
use core::arch::asm;
use fingertip::frame::{BANK_COLUMNS, ROWS, SATURATED};

type Pairs = [u32; BANK_COLUMNS];

const ONES: u32 = lanes::pair(1, 1);
/// -9, -7 .. -1 in the low halves, 1, 3 .. 9 in the high ones.
const WEIGHTS: Pairs =
    [lanes::pair(-9, 1), lanes::pair(-7, 3), lanes::pair(-5, 5), lanes::pair(-3, 7), lanes::pair(-1, 9)];

/// A row's sums.
struct Row {
    /// Net codes, unweighted.
    codes: i32,
    /// Net codes weighted by the first weights.
    sum: i32,
    /// Net codes weighted by the second weights.
    moment: i32,
}

/// What all rows share.
struct Frame {
    signs: u32,
    peaks: u32,
    dead: u32,
}

impl Frame {
    fn new(bench: &Bench) -> Self {
        let dead = bench.config.dead_codes as i16;
        Self { signs: 0, peaks: 0, dead: lanes::pair(dead, dead) }
    }

    #[inline(always)]
    fn row<const GAINS: bool>(&mut self, codes: &Pairs, undriven: &Pairs, first: &Pairs, second: &Pairs) -> Row {
        const SOUND: u32 = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
        let mut row = Row { codes: 0, sum: 0, moment: 0 };
        let mut take = |place: usize| {
            let net = lanes::sub(codes[place], undriven[place]);
            self.signs |= lanes::sub(net, self.dead) | lanes::sub(SOUND, codes[place]);
            self.peaks = larger(self.peaks, net);
            row.codes = lanes::dot(net, ONES, row.codes);
            if GAINS {
                row.sum = lanes::dot(net, first[place], row.sum);
            }
            row.moment = lanes::dot(net, second[place], row.moment);
        };
        // Written out: the compiler would keep a loop where it builds for size.
        take(0);
        take(1);
        take(2);
        take(3);
        take(4);
        row
    }

    fn finish(&self, bench: &mut Bench, out: Sums<i32>, tare: &Sums<i32>, drop: u32) {
        let peak = i32::from(lanes::low(self.peaks).max(lanes::high(self.peaks)));
        bench.out = Sums {
            sum: out.sum - (tare.sum >> drop),
            moment_x: out.moment_x - (tare.moment_x >> drop),
            moment_y: out.moment_y - (tare.moment_y >> drop),
            peak,
        };
        bench.suspect = self.signs & lanes::SIGNS != 0;
    }
}

/// The larger in each lane (SSUB16, SEL).
#[inline(always)]
fn larger(a: u32, b: u32) -> u32 {
    let result;
    // SAFETY: reads and writes registers only; the flags between the two (GE) are read by no other instruction here.
    unsafe {
        asm!("ssub16 {r}, {a}, {b}", "sel {r}, {a}, {b}", r = out(reg) result, a = in(reg) a, b = in(reg) b,
            options(pure, nomem, nostack));
    }
    result
}

/// The sums of a frame; `read` makes a row's sum and its moment, `bits` finer than sixteenths of a code.
#[inline(always)]
fn sums(bench: &mut Bench, bits: u32, read: impl Fn(&Row, u32) -> (i32, i32)) {
    let mut frame = Frame::new(bench);
    let mut out = Sums::default();
    let [rows @ .., undriven] = &bench.frame.pairs;
    let mut weight = 1 - ROWS as i32;
    for ((codes, gain), weighted) in rows.iter().zip(&bench.gain).zip(&bench.weighted) {
        let row = frame.row::<true>(codes, undriven, gain, weighted);
        let (sum, moment) = read(&row, bench.config.sag_q32.into());
        out.sum += sum;
        out.moment_x += moment;
        out.moment_y += sum * weight;
        weight += 2;
    }
    let tare = bench.tare_sums;
    frame.finish(bench, out, &tare, 8 - bits);
}

/// Every taxel counts alike.
pub extern "C" fn plain(bench: &mut Bench) {
    let mut frame = Frame::new(bench);
    let mut out = Sums::default();
    let [rows @ .., undriven] = &bench.frame.pairs;
    let mut weight = 1 - ROWS as i32;
    for codes in rows {
        let row = frame.row::<false>(codes, undriven, &WEIGHTS, &WEIGHTS);
        out.sum += row.codes << 4;
        out.moment_x += row.moment << 4;
        out.moment_y += (row.codes << 4) * weight;
        weight += 2;
    }
    let tare = bench.plain_tare;
    frame.finish(bench, out, &tare, 0);
}

/// Each taxel by its gain.
pub extern "C" fn gains(bench: &mut Bench) {
    sums(bench, 0, |row, _| ((row.sum + (1 << 9)) >> 10, (row.moment + (1 << 6)) >> 7));
}

/// Rows besides by 1 + rho N.
pub extern "C" fn first_order(bench: &mut Bench) {
    sums(bench, 0, |row, sag_q32| {
        let more = row.codes as u32 * sag_q32;
        let boosted = |sum: i32| sum + ((i64::from(sum) * i64::from(more >> 1)) >> 31) as i32;
        ((boosted(row.sum) + (1 << 9)) >> 10, (boosted(row.moment) + (1 << 6)) >> 7)
    });
}

/// Rows besides by 1 / (1 - rho N).
pub extern "C" fn by_rows(bench: &mut Bench) {
    sums(bench, 6, |row, sag_q32| {
        let remaining = (u32::MAX - (row.codes as u32).saturating_mul(sag_q32)) >> 16;
        // Q22; Q14 to Q10 and Q11 to Q10.
        let boost = i64::from((u32::MAX / remaining.max(1 << 15)) << 6);
        (((i64::from(row.sum) * boost) >> 26) as i32, ((i64::from(row.moment) * boost) >> 23) as i32)
    });
}
