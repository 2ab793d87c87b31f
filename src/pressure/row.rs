//! What goes into the pass over a frame, and what is made of its totals.

use super::{CODE_BITS, GAIN_BITS};
use crate::config::Config;
use lanes::{BOOST_BITS, Common, Total, codes_at, each_pair, filled, moment_bits, sum_drop};

/// Bits by which a total is coarser than a row's sum or moment: the upper half of a product with the boost.
const COARSER: u32 = 32 - BOOST_BITS;

/// A frame's sound codes, between dead and saturated.
pub(super) struct Sound<const COLUMNS: usize> {
    /// For the pass.
    pub common: Common<COLUMNS>,
    /// The highest undriven level.
    pub undriven_max: u16,
    /// The smallest sum of [`Sound::largest`] and the highest undriven level that may belong to a bad taxel.
    suspect: u32,
}

impl<const COLUMNS: usize> Sound<COLUMNS> {
    /// From the slot with nothing driven.
    #[inline(always)]
    pub fn new(undriven: &[u16; COLUMNS], config: &Config) -> Self {
        let Config { dead_codes, saturated_codes, sag_q32, .. } = *config;
        let common = Common {
            undriven: *undriven,
            dead: lanes::pair(dead_codes as i16, dead_codes as i16),
            sag: lanes::pair(sag_q32 as i16, sag_q32 as i16),
        };
        let suspect = u32::from(saturated_codes) - u32::from(dead_codes);
        Self { common, undriven_max: highest::<COLUMNS>(|at| codes_at(undriven, at)), suspect }
    }

    /// Whether a taxel may be dead or saturated where this is the largest code less what a dead one shows: that of a
    /// dead one is huge as an unsigned number.
    #[inline(always)]
    pub fn suspects(&self, largest: u16) -> bool {
        u32::from(largest) + u32::from(self.undriven_max) >= self.suspect
    }

    /// That of a row.
    #[inline(always)]
    pub fn largest(&self, codes: &[u16; COLUMNS]) -> u16 {
        let Common { undriven, dead, .. } = &self.common;
        highest::<COLUMNS>(|at| lanes::sub(lanes::sub(codes_at(codes, at), codes_at(undriven, at)), *dead))
    }
}

/// The highest of all lanes of a row, unsigned.
#[inline(always)]
fn highest<const COLUMNS: usize>(of: impl Fn(usize) -> u32) -> u16 {
    let mut most = 0;
    each_pair::<COLUMNS>(|at| {
        let pair = filled::<COLUMNS>(of(at), at);
        most = if at == 0 { pair } else { lanes::larger(pair, most) };
    });
    larger_lane(most)
}

/// The larger of two lanes, unsigned.
#[inline(always)]
pub(super) const fn larger_lane(pair: u32) -> u16 {
    let (low, high) = (pair as u16, (pair >> 16) as u16);
    if low > high { low } else { high }
}

/// Sum and moments of a pass in sixteenths, rounded.
#[inline(always)]
pub(super) fn sixteenths<const ROWS: usize, const COLUMNS: usize>(total: &Total) -> [i32; 3] {
    let sum_bits = const { GAIN_BITS - COARSER - sum_drop(ROWS, COLUMNS) };
    let rounded = |value: i32, bits: u32| (value >> (bits - CODE_BITS - 1)).wrapping_add(1) >> 1;
    // Row n of ten was in the sum 10 - n times: 11 less twice that is its weight. It may wrap, what is made of it fits.
    let moment_y = (total.first >> 2).wrapping_mul(ROWS as i32 + 1).wrapping_sub(total.running.wrapping_mul(2));
    [
        rounded(total.first, sum_bits),
        rounded(total.second, const { moment_bits(COLUMNS) - COARSER }),
        rounded(moment_y, sum_bits - 2),
    ]
}

/// Twice a place's distance from the middle of so many, in pitches.
#[inline(always)]
pub(super) const fn weight(place: usize, of: usize) -> i32 {
    2 * place as i32 + 1 - of as i32
}
