//! One pass over the rows of a frame: from codes to taxels above their tare, their sums, and the highest of them.
//!
//! [`portable_pass`] is the pass to read; [`pass`] gives the same bits, for rows of ten columns by the target's
//! instructions.

use super::{high, low, pair, portable};

/// Fractional bits of a taxel.
pub const CODE_BITS: u32 = 4;
/// Fractional bits of a gain.
pub const GAIN_BITS: u32 = 14;
/// Fractional bits of a tare: what follows it slowly needs steps far below a taxel's.
pub const TARE_BITS: u32 = 16;
/// Fractional bits of a boost.
pub const BOOST_BITS: u32 = 28;
/// Bits by which the boost is shortened for single taxels, whose product is then an upper half.
const BOOST_DROP: u32 = GAIN_BITS + BOOST_BITS - CODE_BITS - 32;
/// Pairs whose products with gains add up to 32 bits: 16 x 4095 x 32767 is just below 2^31.
const BLOCK: usize = 8;

/// Codes of a frame, in the order in which two converters read them: each row as pairs of the same instant, one column
/// of the first half and one of the second. It begins on a word's border.
#[repr(C, align(4))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Codes<const ROWS: usize, const COLUMNS: usize> {
    /// Codes with each row driven, see [`place`].
    pub rows: [[u16; COLUMNS]; ROWS],
    /// Codes with no row driven.
    pub undriven: [u16; COLUMNS],
}

impl<const ROWS: usize, const COLUMNS: usize> Codes<ROWS, COLUMNS> {
    /// Zeros.
    pub const ZERO: Self = Self { rows: [[0; COLUMNS]; ROWS], undriven: [0; COLUMNS] };

    /// Codes of a slot: with the row of this number driven, or with none for the number of rows.
    #[inline(always)]
    pub fn slot(&self, slot: usize) -> Option<&[u16; COLUMNS]> {
        if slot == ROWS { Some(&self.undriven) } else { self.rows.get(slot) }
    }

    /// The same to be written.
    #[inline(always)]
    pub fn slot_mut(&mut self, slot: usize) -> Option<&mut [u16; COLUMNS]> {
        if slot == ROWS { Some(&mut self.undriven) } else { self.rows.get_mut(slot) }
    }
}

/// Pairs of a row; an odd number of columns leaves the last one half empty.
pub const fn pairs(columns: usize) -> usize {
    columns.div_ceil(2)
}

/// Index of a column in a row of codes, gains or moments; beyond the row if there is no such column.
///
/// ```
/// let places = |columns| (0..columns).map(move |column| lanes::place(column, columns));
/// assert!(places(6).eq([0, 2, 4, 1, 3, 5]));
/// assert!(places(5).eq([0, 2, 4, 1, 3]));
/// ```
#[inline(always)]
pub const fn place(column: usize, columns: usize) -> usize {
    let half = pairs(columns);
    if column < half {
        2 * column
    } else if column < columns {
        2 * (column - half) + 1
    } else {
        columns
    }
}

/// Pair of a row of codes; 0 beyond the row.
#[inline(always)]
pub fn codes_at<const COLUMNS: usize>(row: &[u16; COLUMNS], at: usize) -> u32 {
    let code = |place: usize| row.get(place).copied().unwrap_or(0);
    u32::from(code(2 * at)) | u32::from(code(2 * at + 1)) << 16
}

/// Pair of a row of gains or moments; 0 beyond the row.
#[inline(always)]
fn weights_at<const COLUMNS: usize>(row: &[i16; COLUMNS], at: usize) -> u32 {
    let weight = |place: usize| row.get(place).copied().unwrap_or(0);
    pair(weight(2 * at), weight(2 * at + 1))
}

/// Every pair of a row of up to 32 columns in turn, written out: the compiler would keep the loop where it builds for
/// size.
#[inline(always)]
pub fn each_pair<const COLUMNS: usize>(mut act: impl FnMut(usize)) {
    const { assert!(COLUMNS <= 32) };
    macro_rules! each {
        ($($at:literal)*) => { $(if $at < const { pairs(COLUMNS) } { act($at) })* };
    }
    each!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15);
}

/// Replacement of the lane that the last pair of an odd row lacks: the other lane.
#[inline(always)]
pub const fn filled<const COLUMNS: usize>(of: u32, at: usize) -> u32 {
    if 2 * at + 1 < COLUMNS { of } else { of & 0xffff | of << 16 }
}

/// Fractional bits of a row's moment: as many as leave the largest weight, a gain of 2 times `columns - 1`, 16 bits.
pub const fn moment_bits(columns: usize) -> u32 {
    if columns <= 16 { 10 } else { 9 }
}

/// Bits dropped from a row's sum, so that neither it nor the sum of all rows nor their moment passes 32 bits.
///
/// A code adds at most 4095 and a gain nearly 2 in Q14, a boost at most 1.5; a total is 4 bits coarser than a sum. The
/// moment along the rows is a quarter of the total's, and what of it has one sign has the weights 1, 3, 5 .. of half of
/// the rows. 10 x 10 drops none, 16 x 16 one bit, 16 x 32 two.
pub const fn sum_drop(rows: usize, columns: usize) -> u32 {
    let row = columns as u64 * 4095 * 32_767;
    let total = row / 16 * 3 / 2 * rows as u64;
    let moment = row / 64 * 3 / 2 * (rows as u64 * rows as u64 / 4);
    let mut drop = 0;
    while row >> drop >= 1 << 31 || total >> drop >= 1 << 31 || moment >> drop >= 1 << 31 {
        drop += 1;
    }
    drop
}

/// Data of a row before the pass, and results of the pass.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row<const COLUMNS: usize> {
    /// The gain of each column, in the order of the codes.
    pub gains: [i16; COLUMNS],
    /// The weight of each column in the row's moment, its gain in it, in the order of the codes.
    pub moments: [i16; COLUMNS],
    /// Codes of each column without contact, in the columns' order.
    pub tare: [i32; COLUMNS],
    /// Found: 1 / (1 - x) in Q28, where x is the row's sag.
    pub boost: i32,
    /// Found: the largest code less what a dead one shows, in each lane, unsigned: that of a dead one is huge.
    pub largest: u32,
}

/// Data common to the rows of a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Common<const COLUMNS: usize> {
    /// Offset of each column's codes, in the order of the codes.
    pub undriven: [u16; COLUMNS],
    /// A column that shows less is dead; in both lanes.
    pub dead: u32,
    /// The sag for each code, Q32; in both lanes.
    pub sag: u32,
}

/// Sums over the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Total {
    /// Sum of the rows' sums, each less [`sum_drop`] bits times its boost; upper half of the product.
    pub first: i32,
    /// The same of their moments.
    pub second: i32,
    /// A quarter of `first` after each row, added up.
    pub running: i32,
    /// The largest of the rows, in each lane.
    pub largest: u32,
    /// The highest taxel, at least 0.
    pub peak: i32,
}

/// 1 / (1 - x) in Q28, for x in Q32 from -0.32 to 0.32.
///
/// Computed as (1 + x)(1 + x^2)(1 + x^4 + x^8), with a relative error of x^12: 2^-20 at the ends, 2^-46 at 7 %.
#[inline(always)]
fn boost(x: i32) -> i32 {
    let x2 = portable::add_high(0, x, x);
    let x4 = portable::add_high(0, x2, x2);
    let boost = (1 << BOOST_BITS) + (x >> (32 - BOOST_BITS));
    let boost = portable::add_high(boost, boost, x2);
    portable::add_high(boost, boost, portable::add_high(x4, x4, x4))
}

/// A column's net code, gain and shortened boost to its taxel above the tare, rounded once.
#[inline(always)]
fn taxel(net: i16, gain: i16, boost: i32, tare: i32) -> i32 {
    let gained = i64::from(net) * i64::from(gain);
    let boosted = (gained * i64::from(boost) + (1 << 31)) >> 32;
    (boosted as i32).wrapping_sub(tare >> (TARE_BITS - CODE_BITS))
}

/// Converts codes to `taxels`, row by row: net codes times column gain and row boost, less the tare; the row's sag, by
/// the sum of its codes, gives the boost. Also sums the rows with the same factors, without rounding taxel by taxel.
#[inline(always)]
pub fn portable_pass<const ROWS: usize, const COLUMNS: usize>(
    codes: &Codes<ROWS, COLUMNS>,
    rows: &mut [Row<COLUMNS>; ROWS],
    common: &Common<COLUMNS>,
    taxels: &mut [[i32; COLUMNS]; ROWS],
) -> Total {
    let (pairs, drop) = (const { pairs(COLUMNS) }, const { sum_drop(ROWS, COLUMNS) });
    let mut total = Total::default();
    for ((codes, row), taxels) in codes.rows.iter().zip(rows).zip(taxels) {
        // One for each pair; the rest is not used.
        let mut nets = [0; COLUMNS];
        let (mut sag, mut sum, mut moment) = (0, 0, 0_i32);
        row.largest = 0;
        for (number, block) in nets[..pairs].chunks_mut(BLOCK).enumerate() {
            let (mut block_sum, mut block_moment) = (0, 0);
            for (at, net) in (BLOCK * number..).zip(block) {
                *net = portable::sub(codes_at(codes, at), codes_at(&common.undriven, at));
                let above = filled::<COLUMNS>(portable::sub(*net, common.dead), at);
                row.largest = super::larger(row.largest, above);
                sag = portable::dot(*net, common.sag, sag);
                block_sum = portable::dot(*net, weights_at(&row.gains, at), block_sum);
                block_moment = portable::dot(*net, weights_at(&row.moments, at), block_moment);
            }
            sum = i32::wrapping_add(sum, block_sum >> drop);
            moment = moment.wrapping_add(block_moment);
        }
        total.largest = super::larger(total.largest, row.largest);
        row.boost = boost(sag);
        let short = row.boost >> BOOST_DROP;
        for (at, net) in nets.into_iter().enumerate().take(pairs) {
            let gains = weights_at(&row.gains, at);
            let (left, right) = (at, at + pairs);
            taxels[left] = taxel(low(net), low(gains), short, row.tare[left]);
            total.peak = total.peak.max(taxels[left]);
            if right < COLUMNS {
                taxels[right] = taxel(high(net), high(gains), short, row.tare[right]);
                total.peak = total.peak.max(taxels[right]);
            }
        }
        total.first = portable::add_high(total.first, sum, row.boost);
        total.second = portable::add_high(total.second, moment, row.boost);
        total.running = total.running.wrapping_add(total.first >> 2);
    }
    total
}

#[cfg(not(dsp))]
pub use portable_pass as pass;

#[cfg(dsp)]
mod instructions;
#[cfg(dsp)]
pub use instructions::pass;

#[cfg(test)]
mod tests;
