//! The tactile image of a frame: taxels, sums and flags.
//!
//! # Characteristic
//!
//! The force per conductance of an array may grow with conductance. A taxel that shows u codes behind its gain carries
//! f(u) = u (1 + p u / 4096) / (1 + p), in the codes of the full range: f(4096) = 4096. Above its tare B it reads T, so
//! it carries f(T + B) - f(B) = T (q + q p (T + 2 B) / 4096) with q = 1 / (1 + p). In the factor T + B and B count as 0
//! where they are below: a taxel cannot show that, and the parabola would turn. So a reading keeps its sign, and a
//! larger one is never a smaller force.

use super::{CODE_BITS, TARE_BITS, weight};
use crate::config::{Config, Curve};
use crate::units::Newtons;
use fixed::types::I16F16;
use lanes::Row;

/// Tactile image: the array's readings above tare and what they add up to, in sixteenths of a corrected code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TactileImage<const ROWS: usize, const COLUMNS: usize> {
    /// Readings as `taxels[row][column]`; zero if the taxel is masked, dead or saturated, and all zero if the array
    /// is broken.
    pub taxels: [[i32; COLUMNS]; ROWS],
    /// Sum over all taxels that are not bad. If more are bad than [`crate::params::Params::bad_taxels_max`] allows,
    /// the array is broken, and the sum may contain bad taxels.
    pub sum: i32,
    /// Sum weighted by twice the column's distance from the middle, in pitches: -9, -7 .. 9 of ten.
    pub moment_x: i32,
    /// Sum weighted by twice the row's distance from the middle, in pitches.
    pub moment_y: i32,
    /// Highest taxel, at least 0.
    pub peak: i32,
    /// Highest code of a taxel above its column's undriven level, which shows how near the array is to saturation. 0
    /// if a taxel is dead or saturated, masked ones too.
    pub peak_codes: u16,
    /// Bits of the columns that are masked, dead or saturated, for each row.
    pub bad: [u32; ROWS],
    /// Number of taxels that are dead or saturated, and not masked.
    pub bad_count: u16,
    /// Number of bad taxels that were also bad in the frame before: a burst of interference does not hit the same
    /// taxels twice.
    pub bad_again: u16,
    /// Highest undriven level of a column.
    pub undriven_max: u16,
}

impl<const ROWS: usize, const COLUMNS: usize> TactileImage<ROWS, COLUMNS> {
    /// Image before the first frame.
    pub const EMPTY: Self = Self {
        taxels: [[0; COLUMNS]; ROWS],
        sum: 0,
        moment_x: 0,
        moment_y: 0,
        peak: 0,
        peak_codes: 0,
        bad: [0; ROWS],
        bad_count: 0,
        bad_again: 0,
        undriven_max: 0,
    };

    /// Flags bad taxels of a row, a bit each, and removes them while the array is not broken. Returns the highest of
    /// them, at least 0.
    pub(super) fn leave_out(&mut self, row: usize, bad: u32, config: &Config) -> i32 {
        let (Some(taxels), Some(bits)) = (self.taxels.get_mut(row), self.bad.get_mut(row)) else { return 0 };
        *bits |= bad;
        self.bad_count += bad.count_ones() as u16;
        if i32::from(self.bad_count) > config.params.bad_taxels_max {
            return 0;
        }
        let (mut highest, mut left) = (0, bad);
        while left != 0 {
            let column = (left.trailing_zeros() as usize).min(COLUMNS - 1);
            left &= left - 1;
            let taxel = core::mem::take(&mut taxels[column]);
            self.sum = self.sum.wrapping_sub(taxel);
            self.moment_x = self.moment_x.wrapping_sub(taxel.wrapping_mul(weight(column, COLUMNS)));
            self.moment_y = self.moment_y.wrapping_sub(taxel.wrapping_mul(weight(row, ROWS)));
            highest = highest.max(taxel);
        }
        highest
    }

    /// Finds the highest taxel again, after some were removed.
    pub(super) fn find_peak(&mut self) {
        let mut peak = 0;
        // Five at a time: the compiler would keep the loop when it builds for size.
        let (blocks, rest) = self.taxels.as_flattened().as_chunks();
        for [a, b, c, d, e] in blocks {
            peak = peak.max(*a).max(*b).max(*c).max(*d).max(*e);
        }
        for taxel in rest {
            peak = peak.max(*taxel);
        }
        self.peak = peak;
    }

    /// Bits dropped from the force per sixteenth of a code, so that its product with the largest sum fits 64 bits.
    /// With the largest pitch and the front end's least gain that force is 2^38.04 in its unit, and a taxel shows at
    /// most 2^17.6 sixteenths. Codes that the converter does not have may wrap it.
    const FORCE_DROP: u32 = if ROWS * COLUMNS <= 128 { 0 } else { 4 };

    /// Force by the sum: the taxels' area times their pressure, never below zero, and limited to the type's range.
    #[inline(always)]
    pub fn force(&self, config: &Config) -> Newtons {
        let product = i64::from(self.sum.max(0)).wrapping_mul(config.newtons_per_sum_q48 >> Self::FORCE_DROP);
        let upper = product >> (32 - Self::FORCE_DROP);
        // With at most 128 taxels the force is below 2^31.
        let force_bits = if Self::FORCE_DROP == 0 { upper as i32 } else { upper.min(i32::MAX.into()) as i32 };
        Newtons(I16F16::from_bits(force_bits.max(0)))
    }

    /// Pressure of the highest taxel, Pa.
    pub fn peak_pa(&self, config: &Config) -> u32 {
        ((i64::from(self.peak.max(0)) * config.pascals_per_sum_q32) >> 32) as u32
    }
}

/// Fractional bits of a code as a share of the full range.
const RANGE_BITS: u32 = 12;
/// Bits of the largest load of a taxel: four times the full range. A line reads at most three times the full range. A
/// power of two is limited by one instruction (SSAT).
const LARGEST_BITS: u32 = RANGE_BITS + CODE_BITS + 2;

/// Load of a reading above a tare, in sixteenths of a code of the full range. Within one unit of the formula.
///
/// A reading and its tare of codes of 12 bits, gains below 2 and a boost below 1.5 stay below 2^18.6.
#[inline(always)]
fn carried(curve: Curve, taxel: i32, tare: i32) -> i32 {
    // T + B and B in sixteenths, Q12.
    let place = const { TARE_BITS - CODE_BITS };
    let both = (taxel << place).wrapping_add(tare).max(0).wrapping_add(tare.max(0));
    let factor = curve.least.wrapping_add(upper(both, curve.growth));
    let carried = upper(taxel << (32 - Curve::FACTOR_BITS), factor);
    carried.max(-1 << LARGEST_BITS).min((1 << LARGEST_BITS) - 1)
}

/// Replaces an image's readings by the loads, and computes the sums again.
#[inline(never)]
pub(super) fn bend<const ROWS: usize, const COLUMNS: usize>(
    curve: Curve,
    picture: &mut TactileImage<ROWS, COLUMNS>,
    rows: &[Row<COLUMNS>; ROWS],
) {
    // Place n of a line of N is in the sum of its running sums N - n times: N + 1 less twice that is its weight.
    let moment = |line: i32, running: i32, of: usize| line.wrapping_mul(of as i32 + 1).wrapping_sub(running << 1);
    let (mut sum, mut running_sum, mut moment_x, mut peak) = (0_i32, 0_i32, 0_i32, 0);
    for (taxels, row) in picture.taxels.iter_mut().zip(rows) {
        let (mut line, mut running_line) = (0_i32, 0_i32);
        let mut load = |taxel: &mut i32, tare: i32| {
            *taxel = carried(curve, *taxel, tare);
            line = line.wrapping_add(*taxel);
            running_line = running_line.wrapping_add(line);
            peak = peak.max(*taxel);
        };
        // Two in a turn: the compiler does not unroll a loop where it builds for size.
        let (pairs, last) = taxels.as_chunks_mut::<2>();
        let (tares, last_tare) = row.tare.as_chunks::<2>();
        for ([left, right], [left_tare, right_tare]) in pairs.iter_mut().zip(tares) {
            load(left, *left_tare);
            load(right, *right_tare);
        }
        if let ([taxel], [tare]) = (last, last_tare) {
            load(taxel, *tare);
        }
        moment_x = moment_x.wrapping_add(moment(line, running_line, COLUMNS));
        sum = sum.wrapping_add(line);
        running_sum = running_sum.wrapping_add(sum);
    }
    let moment_y = moment(sum, running_sum, ROWS);
    (picture.sum, picture.moment_x, picture.moment_y, picture.peak) = (sum, moment_x, moment_y, peak);
}

/// Returns the upper half of a product, rounded.
#[inline(always)]
const fn upper(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64 + (1 << 31)) >> 32) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corrected taxel in floating point, codes.
    fn exact(permille: i32, taxel: f64, tare: f64) -> f64 {
        let p = f64::from(permille) / 1_000.0;
        let least = 1.0 / (1.0 + p);
        taxel * (least + least * p * ((taxel + tare).max(0.0) + tare) / 4_096.0)
    }

    #[test]
    fn what_a_reading_carries_is_within_a_unit_of_the_formula() {
        let mut worst = 0.0_f64;
        for permille in [1, 300, 3_300, 8_000] {
            let curve = Curve::new(permille).unwrap();
            for tare in (0..=4_096 << TARE_BITS).step_by(19_531_249) {
                for taxel in (-4_096 << CODE_BITS..=8_192 << CODE_BITS).step_by(37) {
                    let carried = f64::from(carried(curve, taxel, tare));
                    let formula = 16.0 * exact(permille, f64::from(taxel) / 16.0, f64::from(tare) / 65_536.0);
                    let largest = f64::from((1 << LARGEST_BITS) - 1);
                    if formula < largest {
                        worst = worst.max((carried - formula).abs());
                    } else {
                        assert_eq!(carried, largest);
                    }
                }
            }
        }
        assert!((0.5..0.52).contains(&worst), "{worst}");
    }

    #[test]
    fn a_larger_reading_never_carries_less() {
        for permille in [1, 1_000, 8_000] {
            let curve = Curve::new(permille).unwrap();
            // The most that codes of 12 bits, gains below 2 and a boost below 1.5 can show.
            let most = 196_560;
            for tare in [-most, 0, 3_000, 65_536, most] {
                let all = (-most - tare..=most - tare).step_by(5).map(|taxel| carried(curve, taxel, tare << 12));
                assert!(all.clone().is_sorted(), "{permille} {tare}");
                assert!(all.clone().all(|carried| (-1 << LARGEST_BITS..1 << LARGEST_BITS).contains(&carried)));
                assert_eq!(carried(curve, 0, tare << 12), 0);
            }
        }
    }

    #[test]
    fn the_full_range_stays_and_a_line_is_none() {
        assert_eq!(Curve::new(0), None);
        for permille in [1, 500, 8_000] {
            assert_eq!(carried(Curve::new(permille).unwrap(), 4_096 << 4, 0), 4_096 << 4, "{permille}");
        }
    }
}
