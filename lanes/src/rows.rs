//! One pass over the rows of a frame: from codes to taxels above their tare, their sums, and the highest of them.
//!
//! [`portable_pass`] is the pass to read; [`pass`] gives the same bits, for rows of ten columns by the target's
//! instructions.

use core::ops::Range;

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
    /// Found with a curve: net codes, in the order of the codes.
    pub nets: [i16; COLUMNS],
    /// Found: 1 / (1 - x) in Q28, where x is the row's sag.
    pub boost: i32,
    /// Found: the largest code less what a dead one shows, in each lane, unsigned: that of a dead one is huge.
    pub largest: u32,
}

impl<const COLUMNS: usize> Row<COLUMNS> {
    /// Row without a tare, before the first pass.
    pub const fn new(gains: [i16; COLUMNS], moments: [i16; COLUMNS]) -> Self {
        Self { gains, moments, tare: [0; COLUMNS], nets: [0; COLUMNS], boost: 1 << BOOST_BITS, largest: 0 }
    }

    /// Reading of a column above its tare, after a pass with a curve, whose taxels are loads.
    #[inline(always)]
    pub fn reading(&self, column: usize) -> i32 {
        let at = place(column, COLUMNS);
        let [net, gain] = [&self.nets, &self.gains].map(|row| row.get(at).copied().unwrap_or(0));
        taxel(net, gain, self.boost, self.tare.get(column).copied().unwrap_or(0))
    }
}

/// Characteristic f(u) = u (1 + p u / 4096) / (1 + p): load of a taxel that shows u codes behind its gain, in the codes
/// of the full range. f(4096) = 4096.
///
/// Above its tare B a taxel reads T, so its load is f(T + B) - f(B) = T (q + q p (T + 2 B) / 4096) with q = 1 / (1 + p).
/// In the factor T + B and B count as 0 where they are below: a taxel cannot show that, and the parabola would turn. So
/// a reading keeps its sign, and a larger one is never a smaller force.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Curve {
    /// q, Q26.
    pub least: i32,
    /// q p, Q30; 0 is a line.
    pub growth: i32,
}

impl Curve {
    /// Linear characteristic: a load equals its reading.
    pub const LINE: Self = Self::new(0);
    /// Fractional bits of q.
    const FACTOR_BITS: u32 = 26;
    /// Fractional bits of a reading that becomes a load. With [`Curve::FACTOR_BITS`] a load has [`CODE_BITS`].
    const FINE_BITS: u32 = 32 + CODE_BITS - Self::FACTOR_BITS;
    /// Bits of the largest load: four times the full range of 12 bits. A line reads at most three times the full range.
    const LARGEST_BITS: u32 = 12 + CODE_BITS + 2;

    /// Constants for p in permille, 0 to 8,000.
    pub const fn new(permille: u32) -> Self {
        let (part, whole) = (permille as u64, 1_000 + permille as u64);
        let least = ((1_000 << Self::FACTOR_BITS) + whole / 2) / whole;
        Self { least: least as i32, growth: (((part << 30) + whole / 2) / whole) as i32 }
    }

    /// Load of a reading with [`Curve::FINE_BITS`] above a tare, in sixteenths of a code of the full range. Within one
    /// unit of the formula.
    ///
    /// A reading and its tare of codes of 12 bits, gains below 2 and a boost below 1.5 stay below 2^14.6 codes.
    #[inline(always)]
    fn load(self, reading: i32, tare: i32) -> i32 {
        // T + B and B, Q16.
        let both = (reading << (TARE_BITS - Self::FINE_BITS)).wrapping_add(tare).max(0).wrapping_add(tare.max(0));
        let load = upper(reading, self.least.wrapping_add(upper(both, self.growth)));
        load.clamp(-1 << Self::LARGEST_BITS, (1 << Self::LARGEST_BITS) - 1)
    }
}

/// Upper half of a product, rounded.
#[inline(always)]
const fn upper(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}

/// Data common to the rows of a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Common {
    /// A column that shows less is dead; in both lanes.
    pub dead: u32,
    /// The sag for each code, Q32; in both lanes.
    pub sag: u32,
    /// The characteristic of all taxels.
    pub curve: Curve,
}

/// Sums over the rows. With a curve `first` sums the taxels, `second` weights each by twice its column's distance from
/// the middle, and `running` accumulates `first` after each row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

impl Total {
    /// The total of no row.
    pub const ZERO: Self = Self { first: 0, second: 0, running: 0, largest: 0, peak: 0 };
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

/// A column's net code, gain and boost to its taxel above the tare, rounded once.
#[inline(always)]
fn taxel(net: i16, gain: i16, boost: i32, tare: i32) -> i32 {
    let gained = i32::from(net) * i32::from(gain);
    upper(gained, boost >> BOOST_DROP).wrapping_sub(tare >> (TARE_BITS - CODE_BITS))
}

/// Converts codes to `taxels`, row by row: net codes times column gain and row boost, less the tare; the row's sag, by
/// the sum of its codes, gives the boost. Also adds the rows to `total` with the same factors, without rounding taxel by
/// taxel.
///
/// Reads the rows in `range` only. A pass over some rows and one over the next ones, which continues its total, give the
/// same bits as one pass over all.
#[inline(always)]
pub fn portable_pass<const ROWS: usize, const COLUMNS: usize>(
    codes: &Codes<ROWS, COLUMNS>,
    rows: &mut [Row<COLUMNS>; ROWS],
    common: &Common,
    taxels: &mut [[i32; COLUMNS]; ROWS],
    range: Range<usize>,
    mut total: Total,
) -> Total {
    let (pairs, drop) = (const { pairs(COLUMNS) }, const { sum_drop(ROWS, COLUMNS) });
    let undriven = &codes.undriven;
    let all = codes.rows.iter().zip(rows).zip(taxels);
    for ((codes, row), taxels) in all.take(range.end).skip(range.start) {
        // One for each pair; the rest is not used.
        let mut nets = [0; COLUMNS];
        let (mut sag, mut sum, mut moment) = (0, 0, 0_i32);
        row.largest = 0;
        for (number, block) in nets[..pairs].chunks_mut(BLOCK).enumerate() {
            let (mut block_sum, mut block_moment) = (0, 0);
            for (at, net) in (BLOCK * number..).zip(block) {
                *net = portable::sub(codes_at(codes, at), codes_at(undriven, at));
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
        let curve = common.curve;
        let mut take = |place: usize, net: i16, gain: i16| {
            let tare = row.tare[place];
            taxels[place] = if curve.growth == 0 {
                taxel(net, gain, row.boost, tare)
            } else {
                let gained = i32::from(net) * i32::from(gain);
                curve.load(upper(gained, row.boost).wrapping_sub(tare >> (TARE_BITS - Curve::FINE_BITS)), tare)
            };
            total.peak = total.peak.max(taxels[place]);
        };
        for (at, net) in nets.into_iter().enumerate().take(pairs) {
            let gains = weights_at(&row.gains, at);
            take(at, low(net), low(gains));
            if at + pairs < COLUMNS {
                take(at + pairs, high(net), high(gains));
            }
        }
        if curve.growth != 0 {
            for (at, net) in row.nets.iter_mut().enumerate() {
                *net = if at % 2 == 0 { low(nets[at / 2]) } else { high(nets[at / 2]) };
            }
            for (weight, taxel) in (1 - COLUMNS as i32..).step_by(2).zip(taxels) {
                total.first = total.first.wrapping_add(*taxel);
                total.second = total.second.wrapping_add(taxel.wrapping_mul(weight));
            }
            total.running = total.running.wrapping_add(total.first);
            continue;
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
