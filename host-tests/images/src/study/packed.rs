//! A frame's sums two taxels an instruction, without a reading of each taxel.
//!
//! A row's sag is common to its taxels, so it may be taken out of the row's sums instead of each taxel.

use super::frame::{Bench, Sums, pairs};
use core::arch::asm;
use fingertip::config::Config;
use fingertip::shipped::{BANK_COLUMNS, ROWS};

type Pairs = [u32; BANK_COLUMNS];

const ONES: u32 = lanes::pair(1, 1);
struct Row {
    /// Net codes, unweighted.
    codes: i32,
    /// Net codes weighted by the first weights.
    sum: i32,
    /// Net codes weighted by the second weights.
    moment: i32,
}

/// Data that all rows share.
struct Frame {
    signs: u32,
    peaks: u32,
    dead: u32,
    sound: u32,
}

impl Frame {
    fn new(bench: &Bench) -> Self {
        let both = |codes: u16| lanes::pair(codes as i16, codes as i16);
        let Config { dead_codes, saturated_codes, .. } = *bench.config;
        Self { signs: 0, peaks: 0, dead: both(dead_codes), sound: both(saturated_codes - 1) }
    }

    #[inline(always)]
    fn row(&mut self, codes: &Pairs, undriven: &Pairs, first: &Pairs, second: &Pairs) -> Row {
        let mut row = Row { codes: 0, sum: 0, moment: 0 };
        let mut take = |place: usize| {
            let net = lanes::sub(codes[place], undriven[place]);
            self.signs |= lanes::sub(net, self.dead) | lanes::sub(self.sound, codes[place]);
            self.peaks = larger(self.peaks, net);
            row.codes = lanes::dot(net, ONES, row.codes);
            row.sum = lanes::dot(net, first[place], row.sum);
            row.moment = lanes::dot(net, second[place], row.moment);
        };
        // Unrolled by hand: the compiler keeps a loop when it builds for size.
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

/// Sums of a frame. `read` computes the sum and the moment of a row, with `bits` bits below sixteenths of a code.
#[inline(always)]
fn sums(bench: &mut Bench, bits: u32, read: impl Fn(&Row, u32) -> (i32, i32)) {
    let mut frame = Frame::new(bench);
    let mut out = Sums::default();
    let [rows @ .., undriven] = pairs(&bench.frame);
    let mut weight = 1 - ROWS as i32;
    for ((codes, gain), weighted) in rows.iter().zip(&bench.gain).zip(&bench.weighted) {
        let row = frame.row(codes, undriven, gain, weighted);
        let (sum, moment) = read(&row, bench.config.sag_q32.into());
        out.sum += sum;
        out.moment_x += moment;
        out.moment_y += sum * weight;
        weight += 2;
    }
    let tare = bench.tare_sums;
    frame.finish(bench, out, &tare, 8 - bits);
}

/// Every taxel counts alike: the codes are added up column by column, and the levels taken off at the end.
pub extern "C" fn plain(bench: &mut Bench) {
    let [rows @ .., undriven] = pairs(&bench.frame);
    let dead = lanes::pair(bench.config.dead_codes as i16, bench.config.dead_codes as i16);
    let halves = |pair: u32| [(pair & 0xffff) as i32, (pair >> 16) as i32];
    let (mut sum, mut moment_x, mut numbered) = (0, 0, 0);
    let (mut largest, mut highest) = (0, 0);
    for place in 0..BANK_COLUMNS {
        let levels = undriven[place];
        let floors = levels.wrapping_add(dead);
        // Ten codes of 12 bits fit a lane.
        let mut column = 0_u32;
        for (number, codes) in (1..).zip(rows) {
            let codes = codes[place];
            column += codes;
            numbered = lanes::dot(codes, lanes::pair(number, number), numbered);
            largest = lanes::larger(largest, lanes::sub(codes, floors));
        }
        highest = lanes::larger(highest, levels);
        let ([left, right], [left_level, right_level]) = (halves(column), halves(levels));
        let (left, right) = (left - ROWS as i32 * left_level, right - ROWS as i32 * right_level);
        sum += left + right;
        moment_x += (left + right) * (2 * place as i32 - 9) + 10 * right;
        // 1 + 2 + .. 10 levels.
        numbered -= 55 * (left_level + right_level);
    }
    let [low, high] = halves(largest);
    let peak = low.max(high) + i32::from(bench.config.dead_codes);
    let [low, high] = halves(highest);
    bench.suspect = peak + low.max(high) >= i32::from(bench.config.saturated_codes);
    let Sums { sum: tare, moment_x: tare_x, moment_y: tare_y, .. } = bench.plain_tare;
    let moment_y = 2 * numbered - 11 * sum;
    bench.out =
        Sums { sum: (sum << 4) - tare, moment_x: (moment_x << 4) - tare_x, moment_y: (moment_y << 4) - tare_y, peak };
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
