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
        let mut wrong = 0;
        let mut sum = 0;
        let net = each(|place| {
            let net = lanes::sub(codes[place], undriven[place]);
            wrong |= signs(net, codes[place], dead_codes);
            sum = lanes::dot(net, ONES, sum);
            net
        });
        Self { net, sum, suspect: wrong & lanes::SIGNS != 0 }
    }

    /// The bad columns, a bit each.
    #[inline(always)]
    pub fn bad(&self, codes: &Pairs, dead_codes: u16) -> u16 {
        let mut bad = 0;
        each(|place| {
            // The low lane's sign to bit 0, the high lane's to bit 5.
            let wrong = signs(self.net[place], codes[place], dead_codes) & lanes::SIGNS;
            bad |= (wrong >> 15 | wrong >> (31 - BANK_COLUMNS)) << place;
            0
        });
        // What the shifts leave beyond: the high lane's sign at bit 16 and up.
        bad as u16 & ((1 << COLUMNS) - 1)
    }

    /// 1 / (1 - rho N) in Q22, at most 2: a row that loses half its voltage is broken, not sagging.
    #[inline(always)]
    fn sag_boost(&self, sag_q32: u32) -> i32 {
        let remaining = (u32::MAX - self.sum.unsigned_abs().saturating_mul(sag_q32)) >> 16;
        ((u32::MAX / remaining.max(1 << 15)) << 6) as i32
    }
}

/// The sign bit of each lane tells whether its taxel is dead or saturated.
#[inline(always)]
fn signs(net: u32, codes: u32, dead_codes: u16) -> u32 {
    let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
    let sound = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
    lanes::sub(net, dead) | lanes::sub(sound, codes)
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
    /// Writes the taxels of a row in sixteenths of a corrected code; zero where the column is bad.
    #[inline(always)]
    pub fn read(
        row: &Row,
        bad: u16,
        tare: &[i32; COLUMNS],
        gain: &Pairs,
        sag_q32: u32,
        out: &mut [i32; COLUMNS],
    ) -> Self {
        let mut columns = Self::default();
        let boost = row.sag_boost(sag_q32);
        each(|place| {
            let (net, gain) = (row.net[place], gain[place]);
            let kept = |column: usize| i32::from(bad >> column & 1) - 1;
            let left = taxel(lanes::low(net), lanes::low(gain), boost, tare[place]) & kept(place);
            let right = taxel(lanes::high(net), lanes::high(gain), boost, tare[place + BANK_COLUMNS])
                & kept(place + BANK_COLUMNS);
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

/// Reads a row that is suspect; also tells its bad columns.
///
/// Apart from the others and from its codes on, so that the common way needs no mask and keeps its numbers in registers.
#[cold]
#[inline(never)]
pub(super) fn read_suspect(
    [codes, undriven]: [&Pairs; 2],
    mask: u16,
    tare: &[i32; COLUMNS],
    gain: &Pairs,
    config: &Config,
    out: &mut [i32; COLUMNS],
) -> (Columns, u16) {
    let row = Row::of(codes, undriven, config.dead_codes);
    let bad = row.bad(codes, config.dead_codes);
    (Columns::read(&row, bad | mask, tare, gain, config.sag_q32, out), bad)
}

/// Every place in turn, written out: the compiler would keep the loop where it builds for size.
#[inline(always)]
fn each(mut act: impl FnMut(usize) -> u32) -> Pairs {
    [act(0), act(1), act(2), act(3), act(4)]
}
