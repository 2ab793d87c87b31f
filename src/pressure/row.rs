//! What goes into the pass over a frame, and what is made of its totals.

use super::{CODE_BITS, GAIN_BITS, each};
use crate::config::Config;
use crate::frame::{COLUMNS, SATURATED};
use lanes::{BOOST_BITS, Common, Pairs, Total};

/// Fractional bits of a row's moment.
const MOMENT_BITS: u32 = 10;
/// Bits by which a total is coarser than a row's sum or moment: the upper half of a product with the boost.
const COARSER: u32 = 32 - BOOST_BITS;

/// A frame's sound codes, between dead and saturated.
pub(super) struct Sound {
    /// For the pass.
    pub common: Common,
    /// The highest undriven level.
    pub undriven_max: u16,
    dead_codes: u16,
}

impl Sound {
    /// From the slot with nothing driven.
    #[inline(always)]
    pub fn new(undriven: &Pairs, config: &Config) -> Self {
        let Config { dead_codes, sag_q32, .. } = *config;
        let common = Common {
            undriven: *undriven,
            dead: lanes::pair(dead_codes as i16, dead_codes as i16),
            sag: lanes::pair(sag_q32 as i16, sag_q32 as i16),
        };
        Self { common, undriven_max: highest(*undriven), dead_codes }
    }

    /// Whether a taxel may be dead or saturated where this is the largest code less what a dead one shows: that of a dead one is
    /// huge as an unsigned number.
    #[inline(always)]
    pub fn suspects(&self, largest: u16) -> bool {
        u32::from(largest) + u32::from(self.undriven_max) + u32::from(self.dead_codes) >= u32::from(SATURATED)
    }

    /// That of a row.
    #[inline(always)]
    pub fn largest(&self, codes: &Pairs) -> u16 {
        let Common { undriven, dead, .. } = &self.common;
        highest(each(|place| lanes::sub(lanes::sub(codes[place], undriven[place]), *dead)))
    }
}

/// The highest of all lanes, unsigned. Written out, see [`each`].
#[inline(always)]
fn highest([a, b, c, d, e]: Pairs) -> u16 {
    larger_lane(lanes::larger(e, lanes::larger(d, lanes::larger(c, lanes::larger(b, a)))))
}

/// The larger of two lanes, unsigned.
#[inline(always)]
pub(super) const fn larger_lane(pair: u32) -> u16 {
    let (low, high) = (pair as u16, (pair >> 16) as u16);
    if low > high { low } else { high }
}

/// Sum and moments of a pass in sixteenths, rounded.
#[inline(always)]
pub(super) fn sixteenths(total: &Total) -> [i32; 3] {
    let rounded = |value: i32, bits: u32| (value >> (bits - CODE_BITS - 1)).wrapping_add(1) >> 1;
    // Row n was in the sum 10 - n times: 11 less twice that is its weight. It may wrap, what is made of it fits.
    let moment_y = (total.first >> 2).wrapping_mul(11).wrapping_sub(total.running.wrapping_mul(2));
    [
        rounded(total.first, GAIN_BITS - COARSER),
        rounded(total.second, MOMENT_BITS - COARSER),
        rounded(moment_y, GAIN_BITS - COARSER - 2),
    ]
}

/// Twice a place's distance from the middle in pitches.
#[inline(always)]
pub(super) const fn weight(place: usize) -> i32 {
    2 * place as i32 + 1 - COLUMNS as i32
}
