//! Codes to pressures: column offsets, the driven row's sag, tare, gain, and the health of every taxel.
//!
//! A column shows `n = K G / (1 + R_on S)` codes above its undriven level, where S is the sum of the driven row's
//! conductances and K the front end's codes per siemens. The row's own sum of codes N = K S / (1 + R_on S) therefore
//! gives the sag exactly: 1 + R_on S = 1 / (1 - rho N) with rho = R_on / K. So `m = n / (1 - rho N)` is what the
//! taxel would show behind a perfect row driver, and m times the taxel's gain, less its tare, is its pressure.
//!
//! [`Array::read`] computes all of it in one pass over the frame ([`lanes::portable_pass`] is the arithmetic): every
//! taxel's pressure, sum and moments, the highest taxel, and whether any may be dead or saturated.

mod calibration;
mod tare;

pub use calibration::{Calibration, CalibrationError, Gains};

use crate::config::Config;
use crate::frame::{Frame, Shape};
use crate::units::Newtons;
use calibration::all;
use fixed::types::I16F16;
use lanes::{
    BOOST_BITS, Codes, Common, Curve, GAIN_BITS, Row, SIGNS, Total, codes_at, each_pair, filled, moment_bits, pairs,
    sum_drop,
};
use tare::Touched;

/// Fractional bits of a corrected code.
pub const CODE_BITS: u32 = lanes::CODE_BITS;
/// Fractional bits of the tare: the baseline's filter needs steps far below one code.
pub const TARE_BITS: u32 = lanes::TARE_BITS;
/// Per-taxel gain of one, Q14. Gains reach from 0 to just below 2.
pub const GAIN_ONE: u16 = 1 << GAIN_BITS;
/// Largest gain.
pub const GAIN_MAX: u16 = (1 << 15) - 1;

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
    fn leave_out(&mut self, row: usize, bad: u32, config: &Config) -> i32 {
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
    fn find_peak(&mut self) {
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

/// Calibration of every taxel, and the tactile image of the last frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array<const ROWS: usize, const COLUMNS: usize> {
    picture: TactileImage<ROWS, COLUMNS>,
    /// Gains, the reading without contact, and the sag of the last frame.
    rows: [Row<COLUMNS>; ROWS],
    /// A bit for each column that is left out.
    mask: [u32; ROWS],
    /// Sum of each row's tares and their moment, in sixteenths of a corrected code.
    tare_lines: [[i32; 2]; ROWS],
    /// Sum and moments of the tare, in sixteenths of a corrected code.
    tare_sums: [i32; 3],
    tare_frames: u32,
    touched: Touched<ROWS>,
    baseline_row: usize,
    /// True if the image holds loads by a characteristic, not readings.
    loads: bool,
    so_far: SoFar,
}

/// Part of a frame that has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SoFar {
    /// Number of the frame.
    sequence: u32,
    /// Number of rows, from the first. After none and after all of them a frame is read from its start.
    rows: usize,
    /// Sums over these rows.
    total: Total,
    /// Highest undriven level of a column.
    undriven_max: u16,
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Array<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Array<ROWS, COLUMNS> {
    /// Gains of one and no tare.
    pub const fn new() -> Self {
        const { Shape::<ROWS, COLUMNS>::CHECKED };
        let [gains, moments] = Calibration::<ROWS, COLUMNS>::NONE.weights[0];
        Self {
            picture: TactileImage::EMPTY,
            rows: [Row::new(gains, moments); ROWS],
            mask: [0; ROWS],
            tare_lines: [[0; 2]; ROWS],
            tare_sums: [0; 3],
            tare_frames: 0,
            touched: Touched::NONE,
            baseline_row: 0,
            loads: false,
            so_far: SoFar { sequence: 0, rows: ROWS, total: Total::ZERO, undriven_max: 0 },
        }
    }

    /// Tactile image of the last frame.
    pub fn picture(&self) -> &TactileImage<ROWS, COLUMNS> {
        &self.picture
    }

    /// Gain of a taxel, Q14; 0 for a masked taxel, and out of range.
    pub fn gain(&self, row: usize, column: usize) -> u16 {
        let gain = self.rows.get(row).and_then(|row| row.gains.get(lanes::place(column, COLUMNS)));
        gain.copied().unwrap_or(0).cast_unsigned()
    }

    /// Tare of every row's taxels: corrected codes with [`TARE_BITS`] fractional bits.
    pub fn tare(&self) -> impl Iterator<Item = &[i32; COLUMNS]> {
        self.rows.iter().map(|row| &row.tare)
    }

    /// Reads the first rows of a frame whose later rows are still being scanned; [`Array::read`] of the frame continues
    /// behind them, with the same result. Returns the number of taxels that these rows show as dead or saturated, and
    /// that the last frame showed in the other rows, without masked ones; and the highest undriven level.
    pub fn begin(&mut self, frame: &Frame<ROWS, COLUMNS>, rows: usize, config: &Config) -> (u16, u16) {
        let rows = rows.min(ROWS);
        self.begin_again();
        self.so_far = self.read_rows(frame, rows, config);
        let mut count = 0;
        let limits = CodeLimits::new(self.so_far.undriven_max, config);
        if limits.suspects(larger_lane(self.so_far.total.largest)) {
            let Codes { rows: codes, undriven } = &frame.codes;
            for ((codes, row), mask) in codes.iter().zip(&self.rows).zip(&self.mask).take(rows) {
                if limits.suspects(larger_lane(row.largest)) {
                    count += (bad_columns([codes, undriven], config) & !mask).count_ones();
                }
            }
        }
        if self.picture.bad_count != 0 {
            let others = self.picture.bad.iter().zip(&self.mask).skip(rows);
            count += others.map(|(bad, mask)| (bad & !mask).count_ones()).sum::<u32>();
        }
        (count as u16, self.so_far.undriven_max)
    }

    /// Lets the next frame be read from its first row on: rows that were read with another configuration or calibration
    /// do not count.
    pub fn begin_again(&mut self) {
        self.so_far.rows = ROWS;
    }

    /// Reads the rows of a frame before row `to` that have not been read.
    #[inline(always)]
    fn read_rows(&mut self, frame: &Frame<ROWS, COLUMNS>, to: usize, config: &Config) -> SoFar {
        let Frame { codes, sequence } = frame;
        let mut so_far = self.so_far;
        if !(1..ROWS).contains(&so_far.rows) || so_far.sequence != *sequence {
            let undriven_max = highest(&codes.undriven);
            so_far = SoFar { sequence: *sequence, rows: 0, total: Total::ZERO, undriven_max };
        }
        // A tare learns what the taxels read, not their loads.
        let curve = if self.tare_frames >= Self::TARE_FRAMES { config.curve } else { Curve::LINE };
        self.loads = curve.growth != 0;
        let common = Common { dead: both(config.dead_codes), sag: both(config.sag_q32), curve };
        let SoFar { rows, total, .. } = so_far;
        let total = lanes::pass(codes, &mut self.rows, &common, &mut self.picture.taxels, rows..to, total);
        SoFar { rows: to, total, ..so_far }
    }

    /// Reads a frame: every taxel, their sums, the peak and the flags. Any codes are accepted: a code that a sound
    /// array cannot show makes its taxel bad.
    pub fn read(&mut self, frame: &Frame<ROWS, COLUMNS>, config: &Config) -> &TactileImage<ROWS, COLUMNS> {
        let SoFar { total, undriven_max, .. } = self.read_rows(frame, ROWS, config);
        self.begin_again();
        // Without a bad taxel in the last frame none is bad again.
        let mut before = None;
        if self.picture.bad_count != 0 {
            before = Some(self.picture.bad);
            (self.picture.bad, self.picture.bad_count, self.picture.bad_again) = (self.mask, 0, 0);
        }
        let limits = CodeLimits::new(undriven_max, config);
        let largest = larger_lane(total.largest);
        self.picture.peak = total.peak;
        self.picture.undriven_max = limits.undriven_max;
        self.picture.peak_codes = largest.wrapping_add(config.dead_codes);
        let [sum, moment_x, moment_y] = if self.loads {
            [total.first, total.second, moment_y::<ROWS>(total.first, total.running)]
        } else {
            let [sum, moment_x, moment_y] = sixteenths::<ROWS, COLUMNS>(&total);
            let [tare, tare_x, tare_y] = self.tare_sums;
            [sum.wrapping_sub(tare), moment_x.wrapping_sub(tare_x), moment_y.wrapping_sub(tare_y)]
        };
        (self.picture.sum, self.picture.moment_x, self.picture.moment_y) = (sum, moment_x, moment_y);
        if limits.suspects(largest) {
            self.leave_out(frame, &limits, &before, config);
        }
        &self.picture
    }

    /// Removes dead and saturated taxels from the image and its sums, and flags them. A broken array must not take
    /// longer: its taxels are set to zero at once, and its sums mean nothing.
    #[cold]
    #[inline(never)]
    fn leave_out(
        &mut self,
        frame: &Frame<ROWS, COLUMNS>,
        limits: &CodeLimits,
        before: &Option<[u32; ROWS]>,
        config: &Config,
    ) {
        let Codes { rows, undriven } = &frame.codes;
        let mut highest = 0;
        for (number, ((codes, row), mask)) in rows.iter().zip(&self.rows).zip(&self.mask).enumerate() {
            if !limits.suspects(larger_lane(row.largest)) {
                continue;
            }
            let bad = bad_columns([codes, undriven], config);
            if bad != 0 {
                self.picture.peak_codes = 0;
            }
            // A masked taxel is no fault.
            let bad = bad & !mask;
            let before = before.as_ref().and_then(|before| before.get(number)).copied().unwrap_or(0);
            self.picture.bad_again += (bad & before).count_ones() as u16;
            highest = self.picture.leave_out(number, bad, config).max(highest);
        }
        let broken = i32::from(self.picture.bad_count) > config.params.bad_taxels_max;
        if broken {
            self.loads = false;
            self.picture.taxels.as_flattened_mut().fill(0);
            self.picture.peak = 0;
        } else if highest > 0 && highest == self.picture.peak {
            self.picture.find_peak();
        }
    }

    /// Resets everything but the gains and the mask.
    pub fn renew(&mut self) {
        let (rows, mask) = (self.rows, self.mask);
        *self = Self::new();
        for (own, Row { gains, moments, .. }) in self.rows.iter_mut().zip(rows) {
            (own.gains, own.moments) = (gains, moments);
        }
        (self.mask, self.picture.bad) = (mask, mask);
    }

    /// Replaces the calibration, and drops the tare, which was measured with the old one.
    pub fn calibrate(&mut self, calibration: &Calibration<ROWS, COLUMNS>) {
        let Calibration { weights, mask } = calibration;
        for (row, [gains, moments]) in self.rows.iter_mut().zip(weights) {
            (row.gains, row.moments) = (*gains, *moments);
        }
        self.mask = *mask;
        (self.picture.bad, self.picture.bad_count, self.picture.bad_again) = (*mask, 0, 0);
        self.begin_again();
        self.touched = Touched::NONE;
        self.start_tare(false);
    }
}

/// Bits by which a total is coarser than a row's sum or moment: the upper half of a product with the boost.
const COARSER: u32 = 32 - BOOST_BITS;

/// Limits of sound codes of a frame, between dead and saturated.
struct CodeLimits {
    /// The highest undriven level.
    undriven_max: u16,
    /// The smallest sum of a row's [`Row::largest`] and the highest undriven level that may belong to a bad taxel.
    suspect: u32,
}

impl CodeLimits {
    #[inline(always)]
    fn new(undriven_max: u16, config: &Config) -> Self {
        Self { undriven_max, suspect: u32::from(config.saturated_codes) - u32::from(config.dead_codes) }
    }

    /// Returns true if a taxel may be dead or saturated, from the largest of the codes less the code of a dead taxel.
    /// A code below that of a dead taxel is huge as an unsigned number.
    #[inline(always)]
    fn suspects(&self, largest: u16) -> bool {
        u32::from(largest) + u32::from(self.undriven_max) >= self.suspect
    }
}

/// Returns the highest code of a row.
#[inline(always)]
fn highest<const COLUMNS: usize>(codes: &[u16; COLUMNS]) -> u16 {
    let mut most = 0;
    each_pair::<COLUMNS>(|at| {
        let pair = filled::<COLUMNS>(codes_at(codes, at), at);
        most = if at == 0 { pair } else { lanes::larger(pair, most) };
    });
    larger_lane(most)
}

/// Returns the larger of two lanes, unsigned.
#[inline(always)]
const fn larger_lane(pair: u32) -> u16 {
    let (low, high) = (pair as u16, (pair >> 16) as u16);
    if low > high { low } else { high }
}

/// Returns sum and moments of a pass in sixteenths, rounded.
#[inline(always)]
fn sixteenths<const ROWS: usize, const COLUMNS: usize>(total: &Total) -> [i32; 3] {
    let sum_bits = const { GAIN_BITS - COARSER - sum_drop(ROWS, COLUMNS) };
    let rounded = |value: i32, bits: u32| (value >> (bits - CODE_BITS - 1)).wrapping_add(1) >> 1;
    [
        rounded(total.first, sum_bits),
        rounded(total.second, const { moment_bits(COLUMNS) - COARSER }),
        rounded(moment_y::<ROWS>(total.first >> 2, total.running), sum_bits - 2),
    ]
}

/// Returns the moment along the rows, from the sum and the sums after each row, added up: row n of ten is in them
/// 10 - n times, and 11 less twice that is its weight. It may wrap, what is made of it fits.
#[inline(always)]
const fn moment_y<const ROWS: usize>(sum: i32, running: i32) -> i32 {
    sum.wrapping_mul(ROWS as i32 + 1).wrapping_sub(running.wrapping_mul(2))
}

/// The same code in both lanes.
#[inline(always)]
const fn both(code: u16) -> u32 {
    lanes::pair(code as i16, code as i16)
}

/// Returns twice the distance of a place from the middle of `of` places, in pitches.
#[inline(always)]
const fn weight(place: usize, of: usize) -> i32 {
    2 * place as i32 + 1 - of as i32
}

/// Returns a bit for each column of a row that is dead or saturated. Any codes and levels are accepted.
#[cold]
#[inline(never)]
fn bad_columns<const COLUMNS: usize>([codes, undriven]: [&[u16; COLUMNS]; 2], config: &Config) -> u32 {
    let (dead, highest) = (both(config.dead_codes), both(config.saturated_codes - 1));
    let mut bad = 0;
    each_pair::<COLUMNS>(|at| {
        let (code, undriven) = (codes_at(codes, at), codes_at(undriven, at));
        let net = lanes::sub(code, undriven);
        // A lane is negative if its taxel is bad; the signs of the first place are shifted most.
        bad = bad >> 1 | (lanes::sub(net, dead) | lanes::sub(highest, code)) & SIGNS;
    });
    let half = pairs(COLUMNS);
    let first = bad >> (16 - half) & all(half);
    let second = bad >> (32 - half);
    // An odd row's last pair has one column only.
    (first | second << half) & all(COLUMNS)
}
