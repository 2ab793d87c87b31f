//! One driven row: ten codes as five pairs, two taxels an instruction where the target has such.

use crate::config::Config;
use crate::frame::{BANK_COLUMNS, COLUMNS, SATURATED};

/// Five pairs: columns 0 to 4 in the low halves, 5 to 9 in the high ones.
type Pairs = [u32; BANK_COLUMNS];

/// One in both lanes: what sums a pair.
const ONES: u32 = lanes::pair(1, 1);

/// Holds the levels of a pair of columns to what a converter can show, so that no net code exceeds its code.
pub(super) const fn held(levels: u32) -> u32 {
    levels & 0x0fff_0fff
}

/// A row before calibration.
pub(super) struct Row {
    /// Codes above the columns' undriven levels.
    net: Pairs,
    /// Their sum.
    sum: i32,
    /// A taxel is dead or saturated.
    pub suspect: bool,
}

impl Row {
    /// Without a branch for each taxel: a sign bit a lane collects what is wrong with any of them.
    #[inline(always)]
    pub fn of(codes: &Pairs, undriven: &Pairs, dead_codes: u16) -> Self {
        let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
        let sound = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
        let mut signs = 0;
        let mut sum = 0;
        let net = each(|place| {
            let net = lanes::sub(codes[place], undriven[place]);
            signs |= lanes::sub(net, dead) | lanes::sub(sound, codes[place]);
            sum = lanes::dot(net, ONES, sum);
            net
        });
        Self { net, sum, suspect: signs & lanes::SIGNS != 0 }
    }

    /// Holds every net code to what a converter can mean, and tells the bad columns, a bit each.
    pub fn leave_out_bad(&mut self, codes: &Pairs, dead_codes: u16) -> u16 {
        let mut bad = 0;
        self.sum = 0;
        for (place, (net, codes)) in self.net.iter_mut().zip(codes).enumerate() {
            let held = |net: i16| net.max(0).min(0xfff);
            let (low, high) = (held(lanes::low(*net)), held(lanes::high(*net)));
            *net = lanes::pair(low, high);
            self.sum += i32::from(low) + i32::from(high);
            let is_bad = |code: u16, net: i16| u16::from(code >= SATURATED || (net as u16) < dead_codes);
            bad |= is_bad(*codes as u16, low) << place;
            bad |= is_bad((*codes >> 16) as u16, high) << (place + BANK_COLUMNS);
        }
        bad
    }

    /// 1 / (1 - rho N) in Q22, at most 2: a row that loses half its voltage is broken, not sagging.
    #[inline(always)]
    fn sag_boost(&self, sag_q32: u32) -> i32 {
        let remaining = (u32::MAX - self.sum.unsigned_abs().saturating_mul(sag_q32)) >> 16;
        ((u32::MAX / remaining.max(1 << 15)) << 6) as i32
    }
}

/// A row's taxels, summed up.
#[derive(Default)]
pub(super) struct Columns {
    /// Columns 5 to 9.
    right: i32,
    both: i32,
    /// Weighted by the place among the five.
    weighted: i32,
    /// The highest taxel, at least 0.
    pub peak: i32,
}

impl Columns {
    /// Writes the taxels of a row in sixteenths of a corrected code.
    #[inline(always)]
    pub fn read(row: &Row, tare: &[i32; COLUMNS], gain: &Pairs, sag_q32: u32, out: &mut [i32; COLUMNS]) -> Self {
        let mut columns = Self::default();
        let boost = row.sag_boost(sag_q32);
        each(|place| {
            let (net, gain) = (row.net[place], gain[place]);
            let left = taxel(lanes::low(net), lanes::low(gain), boost, tare[place]);
            let right = taxel(lanes::high(net), lanes::high(gain), boost, tare[place + BANK_COLUMNS]);
            out[place] = left;
            out[place + BANK_COLUMNS] = right;
            columns.peak = columns.peak.max(left).max(right);
            columns.right += right;
            columns.both += left + right;
            columns.weighted += (left + right) * place as i32;
            0
        });
        columns
    }

    /// Sum of the taxels.
    #[inline(always)]
    pub fn sum(&self) -> i32 {
        self.both
    }

    /// Sum weighted by twice the column's distance from the middle, -9, -7 .. 9.
    #[inline(always)]
    pub fn moment(&self) -> i32 {
        // 2 place - 9 on the left and 2 place + 1 on the right.
        2 * self.weighted - 9 * self.both + 10 * self.right
    }
}

/// Net code, gain in Q14 and boost in Q22 to sixteenths above the tare in Q16, rounded once.
#[inline(always)]
fn taxel(net: i16, gain: i16, boost_q22: i32, tare_q16: i32) -> i32 {
    let gained = i32::from(net) * i32::from(gain);
    let boosted = (i64::from(gained) * i64::from(boost_q22) + (1 << 31)) >> 32;
    boosted as i32 - (tare_q16 >> (super::TARE_BITS - super::CODE_BITS))
}

/// Reads a row with a dead or saturated taxel in it; also tells these, a bit each.
///
/// Apart from the others, so that the common way keeps its numbers in registers.
#[cold]
#[inline(never)]
pub(super) fn read_suspect(
    codes: &Pairs,
    undriven: &Pairs,
    tare: &[i32; COLUMNS],
    gain: &Pairs,
    mask: u16,
    config: &Config,
    out: &mut [i32; COLUMNS],
) -> (Columns, u16) {
    let mut row = Row::of(codes, undriven, config.dead_codes);
    let bad = row.leave_out_bad(codes, config.dead_codes);
    // With zeros for tare and gain these taxels read as nothing.
    let left_out = bad | mask;
    let (mut tare, mut gain) = (*tare, *gain);
    for (column, tare) in tare.iter_mut().enumerate() {
        *tare *= i32::from(left_out >> column & 1 == 0);
    }
    for (place, gain) in gain.iter_mut().enumerate() {
        let low = if left_out >> place & 1 != 0 { 0 } else { 0xffff };
        let high = if left_out >> (place + BANK_COLUMNS) & 1 != 0 { 0 } else { 0xffff_0000 };
        *gain &= low | high;
    }
    (Columns::read(&row, &tare, &gain, config.sag_q32, out), bad)
}

/// Every place in turn, written out: the compiler would keep the loop where it builds for size.
#[inline(always)]
fn each(mut act: impl FnMut(usize) -> u32) -> Pairs {
    [act(0), act(1), act(2), act(3), act(4)]
}
