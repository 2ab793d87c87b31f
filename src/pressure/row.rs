//! One driven row's sums: ten codes as five pairs, two taxels an instruction where the target has such.

use super::{BOOST_BITS, CODE_BITS, GAIN_BITS, Line, each};
use crate::frame::{COLUMNS, ROWS, SATURATED};
use lanes::{Pairs, Weighed};

/// What a converter of 12 bits can show.
pub(super) const CODE_MAX: u16 = 0xfff;
/// Fractional bits of a row's moment.
const MOMENT_BITS: u32 = 10;
/// Bits by which a total is coarser than a row's sum or moment: the upper half of a product with the boost.
const COARSER: u32 = 32 - BOOST_BITS;

/// Holds the levels of a pair of columns to what a converter can show, so that no net code exceeds its code.
pub(super) const fn held(levels: u32) -> u32 {
    levels & lanes::pair(CODE_MAX as i16, CODE_MAX as i16)
}

/// A frame's sound codes, between dead and saturated.
pub(super) struct Sound {
    /// The lowest of each column: its undriven level and what a dead taxel falls short of.
    floors: Pairs,
    /// The highest code above its floor that saturates in no column.
    room: u32,
    /// What the floors hold back of a row's codes.
    held_back: u32,
    /// The highest undriven level.
    pub undriven_max: u16,
}

impl Sound {
    /// From the slot with nothing driven.
    #[inline(always)]
    pub fn new(undriven: &Pairs, dead_codes: u16) -> Self {
        let levels = each(|place| held(undriven[place]));
        let mut highest = 0;
        each(|place| {
            highest = lanes::larger(highest, levels[place]);
            0
        });
        let undriven_max = (highest as u16).max((highest >> 16) as u16);
        let highest = undriven_max.saturating_add(dead_codes);
        // Where not every column has a sound code, a floor out of each code's reach makes every row suspect.
        let (dead, room) = if highest < SATURATED { (dead_codes, SATURATED - 1 - highest) } else { (1 << 15, 0) };
        let both = |lane: u16| lanes::pair(lane as i16, lane as i16);
        let (dead, room) = (both(dead), both(room));
        let held_back = COLUMNS as u32 * u32::from(dead_codes);
        Self { floors: each(|place| levels[place].wrapping_add(dead)), room, held_back, undriven_max }
    }

    /// Not 0 where a row with this largest pair has a taxel that may be dead or saturated: a code below its floor is huge as an
    /// unsigned number.
    #[inline(always)]
    pub fn beyond(&self, largest: u32) -> u32 {
        lanes::excess(largest, self.room)
    }

    /// The largest code of each lane above its floor.
    #[inline(always)]
    pub fn largest(&self, codes: &Pairs) -> u32 {
        let mut largest = 0;
        each(|place| {
            largest = lanes::larger(largest, lanes::sub(codes[place], self.floors[place]));
            0
        });
        largest
    }
}

/// A sound row, summed up.
pub(super) struct Sums {
    /// Net codes: at most 10 times 4089.
    pub codes: u32,
    /// Times the gain, Q14: below 2^31, as 10 * 4089 * 2^15 is.
    pub sum: i32,
    /// Times the weighted gain, Q10: below 2^29, as the weights' sizes sum up to 50.
    pub moment: i32,
    /// The largest above the floors, in each lane.
    pub largest: u32,
}

impl Sums {
    /// Of any codes; they mean something where the row is sound.
    #[inline(always)]
    pub fn new(codes: &Pairs, sound: &Sound, line: &Line) -> Self {
        // The sums begin with what the floors hold back of the net codes.
        let [first, second] = line.held_back;
        let sums = Weighed { plain: 0, first, second, largest: 0 };
        let Weighed { plain, first, second, largest } = lanes::weigh(codes, &sound.floors, &line.gains.weights, sums);
        Self { codes: (plain & 0xffff) + (plain >> 16) + sound.held_back, sum: first, moment: second, largest }
    }
}

/// 1 / (1 - rho N) in Q28, at most 2: a row that loses half its voltage is broken, not sagging.
///
/// It is (1 + x)(1 + x^2)(1 + x^4)(1 + x^8), which leaves out a factor of 1 + x^16 and more: 2^-16 at half the voltage, 2^-61 at 7 %.
#[inline(always)]
pub(super) fn boost(codes: u32, sag_q32: u32) -> i32 {
    // Ten codes of 12 bits and the largest sag fit 32 bits.
    let x = codes.wrapping_mul(sag_q32).min(i32::MAX as u32) as i32;
    let square = |x: i32| ((i64::from(x) * i64::from(x)) >> 32) as i32;
    let x2 = square(x);
    let x4 = square(x2);
    let x8 = square(x4);
    let boost = (1 << BOOST_BITS) + (x >> (32 - BOOST_BITS));
    let boost = lanes::add_high(boost, boost, x2);
    let boost = lanes::add_high(boost, boost, x4);
    lanes::add_high(boost, boost, x8)
}

/// What the rows add up to, the sag taken out; before the tare.
#[derive(Default)]
pub(super) struct Total {
    /// Codes, Q10: 100 taxels of 4095 codes, gain 2 and boost 2 fit.
    pub sum: i32,
    /// Weighted by -9, -7 .. 9 along the columns, Q6.
    pub moment_x: i32,
    /// The sum after each row, added up, Q8: it may wrap, what is made of it fits.
    pub running: i32,
}

impl Total {
    /// Takes in the next row.
    #[inline(always)]
    pub fn add(&mut self, row: &Sums, boost: i32) {
        self.sum = lanes::add_high(self.sum, row.sum, boost);
        self.moment_x = lanes::add_high(self.moment_x, row.moment, boost);
        self.running = self.running.wrapping_add(self.sum >> 2);
    }

    /// Takes in a row that was passed over, when all others are in: its sums without the bad taxels, and as much tare, in sixteenths, as
    /// the bad ones do not have.
    pub fn add_late(&mut self, row: usize, sums: [i32; 2], boost: i32, tares: [i32; 2]) {
        let sum = lanes::add_high(tares[0] << (GAIN_BITS - COARSER - CODE_BITS), sums[0], boost);
        let moment = lanes::add_high(tares[1] << (MOMENT_BITS - COARSER - CODE_BITS), sums[1], boost);
        self.sum = self.sum.wrapping_add(sum);
        self.moment_x = self.moment_x.wrapping_add(moment);
        self.running = self.running.wrapping_add((sum >> 2).wrapping_mul((ROWS - row) as i32));
    }

    /// Sum and moments in sixteenths, rounded.
    #[inline(always)]
    pub fn sixteenths(&self) -> [i32; 3] {
        let rounded = |value: i32, bits: u32| (value >> (bits - CODE_BITS - 1)).wrapping_add(1) >> 1;
        // Row n was in the sum 10 - n times: 11 less twice that is its weight.
        let moment_y = (self.sum >> 2).wrapping_mul(11).wrapping_sub(self.running.wrapping_mul(2));
        [
            rounded(self.sum, GAIN_BITS - COARSER),
            rounded(self.moment_x, MOMENT_BITS - COARSER),
            rounded(moment_y, GAIN_BITS - COARSER - 2),
        ]
    }
}

/// Twice a place's distance from the middle in pitches.
#[inline(always)]
pub(super) const fn weight(place: usize) -> i32 {
    2 * place as i32 + 1 - COLUMNS as i32
}
