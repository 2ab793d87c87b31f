//! One pass over the rows of a frame: from codes to taxels above their tare, their sums, and the highest of them.
//!
//! [`portable_pass`] is the pass to read; [`pass`] gives the same bits by the target's instructions.

use super::{Pairs, high, low, portable};

/// Fractional bits of a taxel.
pub const CODE_BITS: u32 = 4;
/// Fractional bits of a gain.
pub const GAIN_BITS: u32 = 14;
/// Fractional bits of a tare: what follows it slowly needs steps far below a taxel's.
pub const TARE_BITS: u32 = 16;
/// Fractional bits of a boost.
pub const BOOST_BITS: u32 = 28;
/// By so many bits the boost is shortened for single taxels, whose product is then an upper half.
const BOOST_DROP: u32 = GAIN_BITS + BOOST_BITS - CODE_BITS - 32;

/// Columns of a row: the two lanes of five pairs.
pub const COLUMNS: usize = 2 * PLACES;
/// Pairs of a row.
const PLACES: usize = 5;

/// What is known of a row before the pass, and what the pass finds.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// The gain of each column.
    pub gains: Pairs,
    /// The weight of each column in the row's moment, its gain in it.
    pub moments: Pairs,
    /// What each column reads without contact.
    pub tare: [i32; COLUMNS],
    /// Found: 1 / (1 - x) in Q28, where x is the row's sag.
    pub boost: i32,
    /// Found: the largest code less what a dead one shows, in each lane, unsigned: that of a dead one is huge.
    pub largest: u32,
}

/// What is common to the rows of a pass.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Common {
    /// What each column's codes are taken above.
    pub undriven: Pairs,
    /// A column that shows less is dead; in both lanes.
    pub dead: u32,
    /// The sag for each code, Q32; in both lanes.
    pub sag: u32,
}

/// What the rows add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Total {
    /// Sum of the rows' sums, each times its boost; upper half of the product.
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
/// It is (1 + x)(1 + x^2)(1 + x^4 + x^8), which leaves out x^12 of itself and less: 2^-20 at the ends, 2^-46 at 7 %.
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

/// From codes to `taxels`, row by row: net codes, the row's sag by their sum, each column by its gain and the row's boost, less its
/// tare; and the rows' sums by the same gains and boosts, which are not rounded taxel by taxel.
#[inline(always)]
pub fn portable_pass<const ROWS: usize>(
    codes: &[Pairs; ROWS],
    rows: &mut [Row; ROWS],
    common: &Common,
    taxels: &mut [[i32; COLUMNS]; ROWS],
) -> Total {
    let mut total = Total::default();
    for ((codes, row), taxels) in codes.iter().zip(rows).zip(taxels) {
        let mut nets = [0; PLACES];
        let (mut sag, mut sum, mut moment) = (0, 0, 0);
        row.largest = 0;
        for (place, net) in nets.iter_mut().enumerate() {
            *net = portable::sub(codes[place], common.undriven[place]);
            row.largest = super::larger(row.largest, portable::sub(*net, common.dead));
            sag = portable::dot(*net, common.sag, sag);
            sum = portable::dot(*net, row.gains[place], sum);
            moment = portable::dot(*net, row.moments[place], moment);
        }
        total.largest = super::larger(total.largest, row.largest);
        row.boost = boost(sag);
        let short = row.boost >> BOOST_DROP;
        for (place, net) in nets.into_iter().enumerate() {
            let (left, right) = (place, place + PLACES);
            taxels[left] = taxel(low(net), low(row.gains[place]), short, row.tare[left]);
            taxels[right] = taxel(high(net), high(row.gains[place]), short, row.tare[right]);
            total.peak = total.peak.max(taxels[left]).max(taxels[right]);
        }
        total.first = portable::add_high(total.first, sum, row.boost);
        total.second = portable::add_high(total.second, moment, row.boost);
        total.running = total.running.wrapping_add(total.first >> 2);
    }
    total
}

#[cfg(not(all(target_arch = "arm", target_os = "none")))]
pub use portable_pass as pass;

#[cfg(all(target_arch = "arm", target_os = "none"))]
mod instructions;
#[cfg(all(target_arch = "arm", target_os = "none"))]
pub use instructions::pass;

#[cfg(test)]
mod tests {
    use super::super::pair;
    use super::{BOOST_BITS, Common, PLACES, Row, boost, pass};

    const ONE: f64 = (1_u64 << 32) as f64;

    #[test]
    fn the_boost_takes_the_sag_out() {
        let (mut ends, mut usual) = (0.0_f64, 0.0_f64);
        for x in (-1_370_000_000..=1_370_000_000).step_by(100_003) {
            let exact = f64::from(1 << BOOST_BITS) / (1.0 - f64::from(x) / ONE);
            let error = (f64::from(boost(x)) - exact).abs() / exact;
            ends = ends.max(error);
            if x.abs() < 300_000_000 {
                usual = usual.max(error);
            }
        }
        let unit = 1.0 / f64::from(1 << BOOST_BITS);
        assert!(ends < 1.2 / 1_048_576.0 && ends > 0.8 / 1_048_576.0, "{ends:e}");
        assert!(usual < 4.0 * unit && usual > unit, "{usual:e}");
    }

    #[test]
    fn a_pass_is_what_its_parts_say() {
        let codes = [[0x0102_0304, 5, 6 << 16, 0x0fff_0fff, 9], [0x0001_0002, 0, 0, 0, 0x0100_0001]];
        let common = Common { undriven: [1, 2, 1 << 16, 0x0ffe_0ffe, 3], dead: 2 | 2 << 16, sag: 3 | 3 << 16 };
        let tare = [5 << 16, -(3 << 16), 0, 0, 7, 9 << 12, 0, 0, -1, 1 << 20];
        let (gains, moments) = ([2 << 14 | 1 << 30; PLACES], [0xffff, 3, 0, 0, 5]);
        let mut rows = [Row { gains, moments, tare, boost: 0, largest: 7 }; 2];
        let mut taxels = [[0; 10]; 2];
        let total = pass(&codes, &mut rows, &common, &mut taxels);
        let lanes = |pair: u32| [i64::from(pair as u16 as i16), i64::from((pair >> 16) as u16 as i16)];
        let (mut first, mut second, mut running, mut peak, mut all) = (0, 0, 0, 0, [0; 2]);
        for ((codes, row), taxels) in codes.iter().zip(&rows).zip(taxels) {
            let net = |column: usize| {
                let [place, lane] = [column % PLACES, column / PLACES];
                lanes(codes[place])[lane] - lanes(common.undriven[place])[lane]
            };
            let by = |weights: [u32; 5], column: usize| lanes(weights[column % PLACES])[column / PLACES];
            assert_eq!(row.boost, boost((0..10).map(|column| 3 * net(column)).sum::<i64>() as i32));
            let mut largest = [0; 2];
            for (column, taxel) in taxels.into_iter().enumerate() {
                let exact = net(column) as f64 * by(gains, column) as f64 / 16_384.0 * f64::from(row.boost);
                let exact = 16.0 * exact / f64::from(1 << BOOST_BITS) - f64::from(tare[column] >> 12);
                assert!((f64::from(taxel) - exact).abs() <= 0.51, "{column}: {taxel}, not {exact}");
                peak = peak.max(taxel);
                let above = (net(column) - 2) as u16;
                largest[column / PLACES] = above.max(largest[column / PLACES]);
            }
            assert_eq!(row.largest, pair(largest[0] as i16, largest[1] as i16), "{:x}", row.largest);
            all = [0, 1].map(|lane| largest[lane].max(all[lane]));
            let boosted =
                |weights| ((0..10).map(|c| net(c) * by(weights, c)).sum::<i64>() * i64::from(row.boost)) >> 32;
            first += boosted(gains);
            second += boosted(moments);
            running += first >> 2;
        }
        assert_eq!([total.first, total.second, total.running].map(i64::from), [first, second, running]);
        assert_eq!(total.peak, peak);
        assert!(peak > 1_000, "there is one");
        // The second row's codes below their levels are huge.
        assert_eq!(total.largest, pair(all[0] as i16, all[1] as i16), "{:x}", total.largest);
        assert!(all.into_iter().all(|largest| largest > 0xff00), "{all:x?}");
    }
}
