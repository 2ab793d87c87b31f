//! Codes to pressures: column offsets, the driven row's sag, tare, gain, and the health of every taxel.
//!
//! A column shows `n = K G / (1 + R_on S)` codes above its undriven level, where S is the sum of the driven row's
//! conductances and K the front end's codes per siemens. The row's own sum of codes N = K S / (1 + R_on S) therefore
//! tells the sag exactly: 1 + R_on S = 1 / (1 - rho N) with rho = R_on / K. So `m = n / (1 - rho N)` is what the
//! taxel would show behind a perfect row driver, and m times the taxel's gain, less its tare, is its pressure.
//!
//! The sag is common to a row, so it is taken out of the row's sums: the pass over a frame ([`Array::read`]) makes sums and flags
//! alone, two taxels an instruction. Single taxels are worked out row by row, where somebody looks at them ([`Array::develop`]).

mod calibration;
mod picture;
mod row;
mod suspect;
mod tare;
mod taxels;

pub use calibration::{Calibration, CalibrationError};
pub use picture::Picture;
pub use tare::TARE_FRAMES;

use crate::config::Config;
use crate::frame::{COLUMNS, Frame, ROWS};
use lanes::{BOOST_BITS, Pairs, Row, Total};
use row::Sound;
use suspect::Share;

/// Fractional bits of a corrected code.
pub const CODE_BITS: u32 = 4;
/// Fractional bits of the tare: the baseline's filter needs steps far below one code.
const TARE_BITS: u32 = 16;
/// Fractional bits of a gain.
const GAIN_BITS: u32 = 14;
/// Per-taxel gain of one, Q14. Gains reach from 0 to just below 2.
pub const GAIN_ONE: u16 = 1 << GAIN_BITS;
/// Largest gain.
pub const GAIN_MAX: u16 = (1 << 15) - 1;
/// A bit for each row.
pub const ALL_ROWS: u16 = (1 << ROWS) - 1;

/// Per-taxel calibration and the last picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    picture: Picture,
    /// Gains, what the floors hold back of the rows' sums (see [`Sound`]), and the sag of the last frame.
    rows: [Row; ROWS],
    /// The highest taxel of each row when that was last developed.
    peaks: [i32; ROWS],
    /// What is held back was worked out for so many.
    dead_codes: u16,
    /// A bit for each column that is left out.
    mask: [u16; ROWS],
    /// Reading without contact, codes in Q16.
    tare: [[i32; COLUMNS]; ROWS],
    /// Sum of each row's tares and their moment, in sixteenths of a corrected code.
    tare_lines: [[i32; 2]; ROWS],
    /// Sum and moments of the tare, in sixteenths of a corrected code.
    tare_sums: [i32; 3],
    tare_frames: u32,
    baseline_row: usize,
    /// Rounds of the baseline over all rows since a contact.
    clear_rounds: i32,
}

impl Default for Array {
    fn default() -> Self {
        Self::new()
    }
}

impl Array {
    /// Gains of one and no tare.
    pub const fn new() -> Self {
        Self {
            picture: Picture::EMPTY,
            rows: [Row { weights: Calibration::NONE.weights[0], start: [0; 2], boost: 1 << BOOST_BITS }; ROWS],
            peaks: [0; ROWS],
            dead_codes: 0,
            mask: [0; ROWS],
            tare: [[0; COLUMNS]; ROWS],
            tare_lines: [[0; 2]; ROWS],
            tare_sums: [0; 3],
            tare_frames: 0,
            baseline_row: 0,
            clear_rounds: 0,
        }
    }

    /// The picture of the last frame.
    pub fn picture(&self) -> &Picture {
        &self.picture
    }

    /// The tare of every taxel in sixteenths of a corrected code, row by row.
    pub fn tare(&self) -> impl Iterator<Item = i32> + '_ {
        self.tare.iter().flatten().map(|tare| tare >> (TARE_BITS - CODE_BITS))
    }

    /// Reads a frame's sums and flags. Any codes are taken: what a sound array cannot show becomes a bad taxel. The picture's single
    /// taxels and its peak stay as they are, see [`Array::develop`].
    pub fn read(&mut self, frame: &Frame, config: &Config) -> &Picture {
        let [rows @ .., undriven] = &frame.pairs;
        if config.dead_codes != self.dead_codes {
            self.hold_back(config.dead_codes);
        }
        if self.picture.bad_count != 0 {
            (self.picture.bad, self.picture.bad_count) = (self.mask, 0);
        }
        let sound = Sound::new(undriven, config);
        let mut total = lanes::pass(rows, &mut self.rows, &sound.common);
        let largest = row::larger_lane(total.largest);
        self.picture.undriven_max = sound.undriven_max;
        self.picture.peak_codes = largest.wrapping_add(config.dead_codes);
        if sound.suspects(largest) {
            self.leave_out(frame, config, &mut total);
        }
        let [sum, moment_x, moment_y] = self.tare_sums;
        let [total_sum, total_x, total_y] = row::sixteenths(&total);
        self.picture.sum = total_sum.wrapping_sub(sum);
        self.picture.moment_x = total_x.wrapping_sub(moment_x);
        self.picture.moment_y = total_y.wrapping_sub(moment_y);
        &self.picture
    }

    /// Works out what floors of so many codes above the undriven levels hold back.
    #[cold]
    #[inline(never)]
    fn hold_back(&mut self, dead_codes: u16) {
        self.dead_codes = dead_codes;
        let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
        for row in &mut self.rows {
            row.start = row.weights.map(|weights| weights.into_iter().fold(0, |sum, pair| lanes::dot(pair, dead, sum)));
        }
    }

    /// Takes dead and saturated taxels out of a pass, and tells which they are.
    #[cold]
    #[inline(never)]
    fn leave_out(&mut self, frame: &Frame, config: &Config, total: &mut Total) {
        let [rows @ .., undriven] = &frame.pairs;
        for (row, codes) in rows.iter().enumerate() {
            let bad = suspect::bad([codes, undriven], config.dead_codes);
            if bad == 0 {
                continue;
            }
            self.picture.peak_codes = 0;
            // Masked taxels have neither gain nor tare.
            let bad = bad & !self.mask[row];
            self.picture.bad[row] |= bad;
            self.picture.bad_count += bad.count_ones() as u8;
            // An array that is broken anyhow must not take long.
            if i32::from(self.picture.bad_count) <= config.params.bad_taxels_max {
                let share = Share::new(bad, [codes, undriven], &self.rows[row], &self.tare[row]);
                row::leave_out(total, row, &share, self.rows[row].boost);
            }
        }
    }

    /// Works out the single taxels of some rows (a bit each) for the picture, from the frame last read.
    pub fn develop(&mut self, frame: &Frame, rows: u16) {
        let mut rows = rows & ALL_ROWS;
        while rows != 0 {
            self.develop_row(rows.trailing_zeros() as usize, frame);
            rows &= rows - 1;
        }
        let [a, b, c, d, e, f, g, h, i, j] = self.peaks;
        self.picture.peak = a.max(b).max(c).max(d).max(e).max(f).max(g).max(h).max(i).max(j);
    }

    /// Reads a frame with all of its taxels.
    pub fn read_all(&mut self, frame: &Frame, config: &Config) -> &Picture {
        self.read(frame, config);
        self.develop(frame, ALL_ROWS);
        &self.picture
    }

    /// Works out a row's taxels.
    fn develop_row(&mut self, row: usize, frame: &Frame) {
        let row = row.min(ROWS - 1);
        let [rows @ .., undriven] = &frame.pairs;
        let out = &mut self.picture.taxels[row];
        self.peaks[row] = taxels::develop([&rows[row], undriven], &self.rows[row], &self.tare[row], out);
        let bad = self.picture.bad[row] & !self.mask[row];
        if bad != 0 {
            self.peaks[row] = taxels::leave_out(bad, out);
        }
    }

    /// Taxels that a frame shows as dead or saturated, masked ones aside: [`Array::read`] without the readings, and quicker.
    pub fn bad_taxels(&self, frame: &Frame, config: &Config) -> u32 {
        let [rows @ .., undriven] = &frame.pairs;
        let sound = Sound::new(undriven, config);
        let mut count = 0;
        for (codes, mask) in rows.iter().zip(&self.mask) {
            if sound.suspects(sound.largest(codes)) {
                count += (suspect::bad([codes, undriven], config.dead_codes) & !mask).count_ones();
            }
        }
        count
    }

    /// Replaces the calibration; the tare, which was measured with the old one, is forgotten.
    pub fn calibrate(&mut self, calibration: &Calibration) {
        let Calibration { weights, mask } = calibration;
        for (row, weights) in self.rows.iter_mut().zip(weights) {
            row.weights = *weights;
        }
        self.hold_back(self.dead_codes);
        self.mask = *mask;
        (self.picture.bad, self.picture.bad_count) = (*mask, 0);
        self.start_tare();
    }
}

/// Every place in turn, written out: the compiler would keep the loop where it builds for size.
#[inline(always)]
fn each(mut act: impl FnMut(usize) -> u32) -> Pairs {
    [act(0), act(1), act(2), act(3), act(4)]
}
