//! What a frame shows: taxels, sums and flags.

use super::row::weight;
use crate::config::Config;
use crate::units::Newtons;
use fixed::types::I16F16;

/// The array's readings above tare and what they add up to, in sixteenths of a corrected code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picture<const ROWS: usize, const COLUMNS: usize> {
    /// `taxels[row][column]`, zero where the taxel is masked, dead or saturated, and all zero where the array is
    /// broken.
    pub taxels: [[i32; COLUMNS]; ROWS],
    /// Sum over all taxels that are not bad. Where more are bad than [`crate::params::Params::bad_taxels_max`] allows,
    /// the array is broken, and bad ones may be in it.
    pub sum: i32,
    /// Sum weighted by twice the column's distance from the middle, in pitches: -9, -7 .. 9 of ten.
    pub moment_x: i32,
    /// Sum weighted by twice the row's distance from the middle, in pitches.
    pub moment_y: i32,
    /// The highest taxel, at least 0.
    pub peak: i32,
    /// The highest code of a taxel above its column's undriven level: how near the array is to saturation. 0 where a
    /// taxel is dead or saturated, masked ones too.
    pub peak_codes: u16,
    /// A bit for each column that is masked, dead or saturated, for each row.
    pub bad: [u32; ROWS],
    /// Taxels that are dead or saturated, and not masked.
    pub bad_count: u16,
    /// Those of them that were so in the frame before: a burst of interference does not hit the same ones twice.
    pub bad_again: u16,
    /// The highest undriven column level.
    pub undriven_max: u16,
}

impl<const ROWS: usize, const COLUMNS: usize> Picture<ROWS, COLUMNS> {
    /// Nothing seen.
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

    /// Notes bad taxels of a row, a bit each, and takes them out while the array is not broken; the highest of them, at
    /// least 0.
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

    /// The highest taxel anew, where some were left out.
    pub(super) fn find_peak(&mut self) {
        let mut peak = 0;
        // Some at a time written out: the compiler would keep the loop where it builds for size.
        let (blocks, rest) = self.taxels.as_flattened().as_chunks();
        for [a, b, c, d, e] in blocks {
            peak = peak.max(*a).max(*b).max(*c).max(*d).max(*e);
        }
        for taxel in rest {
            peak = peak.max(*taxel);
        }
        self.peak = peak;
    }

    /// Bits dropped from the force of a sixteenth of a code, so that its product with the largest sum fits 64 bits:
    /// with the largest pitch and the front end's least gain that force is 2^38.04 in its unit, and a taxel shows at
    /// most 2^17.6 sixteenths. Codes that the converter does not have may wrap it.
    const FORCE_DROP: u32 = if ROWS * COLUMNS <= 128 { 0 } else { 4 };

    /// The sum as a force: the taxels' area times their pressure, never below zero, and stopped at the type's end.
    #[inline(always)]
    pub fn force(&self, config: &Config) -> Newtons {
        let product = i64::from(self.sum.max(0)).wrapping_mul(config.newtons_per_sum_q48 >> Self::FORCE_DROP);
        let upper = product >> (32 - Self::FORCE_DROP);
        // Of so few taxels it is below 2^31.
        let force_bits = if Self::FORCE_DROP == 0 { upper as i32 } else { upper.min(i32::MAX.into()) as i32 };
        Newtons(I16F16::from_bits(force_bits.max(0)))
    }

    /// The peak as a pressure in Pa.
    pub fn peak_pa(&self, config: &Config) -> u32 {
        ((i64::from(self.peak.max(0)) * config.pascals_per_sum_q32) >> 32) as u32
    }
}
