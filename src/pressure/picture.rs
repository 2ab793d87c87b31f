//! The tactile image of a frame: taxels, sums and flags.

use super::weight;
use crate::config::Config;
use crate::units::Newtons;
use fixed::types::I16F16;

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
