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
mod taxels;

pub use calibration::{Calibration, CalibrationError};
pub use picture::Picture;

use crate::config::Config;
use crate::frame::{COLUMNS, Frame, ROWS};
use calibration::Gains;
use lanes::Pairs;
use row::{Sound, Sums, Total};

/// Fractional bits of a corrected code.
pub const CODE_BITS: u32 = 4;
/// Fractional bits of the tare: the baseline's filter needs steps far below one code.
const TARE_BITS: u32 = 16;
/// Frames averaged by a tare.
pub const TARE_FRAMES: u32 = 64;
/// Weight of a frame in the baseline, Q16; each row is visited every tenth frame, so the time constant is 10,240 frames.
const BASELINE_WEIGHT: i32 = 64;
/// Fractional bits of what takes a row's sag out.
const BOOST_BITS: u32 = 28;
/// Fractional bits of a gain.
const GAIN_BITS: u32 = 14;
/// Per-taxel gain of one, Q14. Gains reach from 0 to just below 2.
pub const GAIN_ONE: u16 = 1 << GAIN_BITS;
/// Largest gain.
pub const GAIN_MAX: u16 = (1 << 15) - 1;
/// A bit for each row.
pub const ALL_ROWS: u16 = (1 << ROWS) - 1;

/// A row's calibration, tare, and what the last frame showed of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Line {
    gains: Gains,
    /// Sum and moment of the codes that the floors hold back, see [`Sound`].
    held_back: [i32; 2],
    /// 1 / (1 - rho N), Q28.
    boost: i32,
    /// Sum of the tares and their moment, in sixteenths of a corrected code.
    tare_sum: i32,
    tare_moment: i32,
    /// The highest taxel when the row was last developed.
    peak: i32,
}

impl Line {
    const fn new(gains: Gains) -> Self {
        Self { gains, held_back: [0; 2], boost: 1 << BOOST_BITS, tare_sum: 0, tare_moment: 0, peak: 0 }
    }
}

/// Per-taxel calibration and the last picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    picture: Picture,
    lines: [Line; ROWS],
    /// What the lines' `held_back` was made for.
    dead_codes: u16,
    /// A bit for each column that is left out.
    mask: [u16; ROWS],
    /// Reading without contact, codes in Q16.
    tare: [[i32; COLUMNS]; ROWS],
    /// Sum and moments of the tare, in sixteenths of a corrected code.
    tare_sums: [i32; 3],
    tare_frames: u32,
    baseline_row: usize,
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
            lines: [Line::new(Calibration::NONE.rows[0]); ROWS],
            dead_codes: 0,
            mask: [0; ROWS],
            tare: [[0; COLUMNS]; ROWS],
            tare_sums: [0; 3],
            tare_frames: 0,
            baseline_row: 0,
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
        let sound = Sound::new(undriven, config.dead_codes);
        if config.dead_codes != self.dead_codes {
            self.hold_back(config.dead_codes);
        }
        if self.picture.bad_count != 0 {
            (self.picture.bad, self.picture.bad_count) = (self.mask, 0);
        }
        self.picture.undriven_max = sound.undriven_max;
        let mut total = Total::default();
        let mut left_out = 0;
        for (codes, line) in rows.iter().zip(&mut self.lines) {
            let sums = Sums::new(codes, &sound, line);
            line.boost = row::boost(sums.codes, config.sag_q32);
            let beyond = sound.beyond(sums.largest);
            left_out |= beyond;
            total.add(&sums, if beyond == 0 { line.boost } else { 0 });
        }
        if left_out != 0 {
            self.read_suspects(frame, config, &sound, &mut total);
        }
        let [sum, moment_x, moment_y] = self.tare_sums;
        let [total_sum, total_x, total_y] = total.sixteenths();
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
        for line in &mut self.lines {
            line.held_back = line.gains.sums.map(|sum| sum.wrapping_mul(dead_codes.into()));
        }
    }

    /// Reads the rows in which a taxel may be dead or saturated: such a one is left out.
    #[cold]
    #[inline(never)]
    fn read_suspects(&mut self, frame: &Frame, config: &Config, sound: &Sound, total: &mut Total) {
        let [rows @ .., undriven] = &frame.pairs;
        for (row, codes) in rows.iter().enumerate() {
            if sound.beyond(sound.largest(codes)) == 0 {
                continue;
            }
            self.lines[row].boost = row::boost(taxels::net_sum(codes, undriven), config.sag_q32);
            let mask = self.mask[row];
            let found = taxels::bad(codes, undriven, config.dead_codes) & !mask;
            self.picture.bad[row] |= found;
            self.picture.bad_count += found.count_ones() as u8;
            self.develop_row(row, frame);
            let [sum, moment] = row_sums(&self.picture.taxels[row]);
            let Line { tare_sum, tare_moment, .. } = self.lines[row];
            total.add_late(row, sum.wrapping_add(tare_sum), moment.wrapping_add(tare_moment));
        }
    }

    /// Works out the single taxels of some rows (a bit each) for the picture, from the frame last read.
    pub fn develop(&mut self, frame: &Frame, rows: u16) {
        for row in 0..ROWS {
            if rows >> row & 1 != 0 {
                self.develop_row(row, frame);
            }
        }
        self.picture.peak = self.lines.iter().fold(0, |peak, line| peak.max(line.peak));
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
        let (line, out) = (&mut self.lines[row], &mut self.picture.taxels[row]);
        line.peak = taxels::develop([&rows[row], undriven], &line.gains, line.boost, &self.tare[row], out);
        let bad = self.picture.bad[row] & !self.mask[row];
        if bad != 0 {
            line.peak = taxels::leave_out(bad, out);
        }
    }

    /// Taxels that a frame shows as dead or saturated, masked ones aside: [`Array::read`] without the readings, and quicker.
    pub fn bad_taxels(&self, frame: &Frame, config: &Config) -> u32 {
        let [rows @ .., undriven] = &frame.pairs;
        let sound = Sound::new(undriven, config.dead_codes);
        let mut count = 0;
        for (codes, mask) in rows.iter().zip(&self.mask) {
            if sound.beyond(sound.largest(codes)) != 0 {
                count += (taxels::bad(codes, undriven, config.dead_codes) & !mask).count_ones();
            }
        }
        count
    }

    /// Replaces the calibration; the tare, which was measured with the old one, is forgotten.
    pub fn calibrate(&mut self, calibration: &Calibration) {
        let Calibration { rows, mask } = calibration;
        for (line, gains) in self.lines.iter_mut().zip(rows) {
            line.gains = *gains;
        }
        self.hold_back(self.dead_codes);
        self.mask = *mask;
        (self.picture.bad, self.picture.bad_count) = (*mask, 0);
        self.start_tare();
    }

    /// Forgets the tare and starts to measure it anew.
    pub fn start_tare(&mut self) {
        self.tare = [[0; COLUMNS]; ROWS];
        for line in &mut self.lines {
            (line.tare_sum, line.tare_moment) = (0, 0);
        }
        self.tare_sums = [0; 3];
        self.tare_frames = 0;
    }

    /// Takes the picture last read into the tare's running mean; true when the tare is complete. All rows must be developed.
    pub fn continue_tare(&mut self) -> bool {
        self.tare_frames += 1;
        let weight = (1 << 16) / self.tare_frames.clamp(1, TARE_FRAMES) as i32;
        // The sums are not rounded taxel by taxel, so they have a mean of their own.
        let Picture { sum, moment_x, moment_y, .. } = self.picture;
        let mut tare_sums = self.tare_sums;
        for (tare, value) in tare_sums.iter_mut().zip([sum, moment_x, moment_y]) {
            *tare = tare.wrapping_add(((i64::from(value) * i64::from(weight) + (1 << 15)) >> 16) as i32);
        }
        for row in 0..ROWS {
            self.learn(row, weight);
        }
        self.tare_sums = tare_sums;
        self.tare_frames >= TARE_FRAMES
    }

    /// The row, as a bit, that [`Array::follow_drift`] looks at next.
    pub fn drift_row(&self) -> u16 {
        1 << self.baseline_row.min(ROWS - 1)
    }

    /// Lets the baseline follow the picture, one row a frame, which must be developed; call it only where there is no contact.
    pub fn follow_drift(&mut self) {
        self.learn(self.baseline_row, BASELINE_WEIGHT);
        self.baseline_row = if self.baseline_row + 1 < ROWS { self.baseline_row + 1 } else { 0 };
    }

    /// Moves each tare of a row by `weight` (Q16) of what the taxel now reads above it. It wraps only for codes that no
    /// converter of 12 bits gives.
    fn learn(&mut self, row: usize, weight: i32) {
        let row = row.min(ROWS - 1);
        for (tare, value) in self.tare[row].iter_mut().zip(&self.picture.taxels[row]) {
            *tare = tare.wrapping_add(((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32);
        }
        let tares = self.tare[row].map(|tare| tare >> (TARE_BITS - CODE_BITS));
        let [sum, moment] = row_sums(&tares);
        let line = &mut self.lines[row];
        let more = sum - line.tare_sum;
        let changes = [more, moment - line.tare_moment, more * row::weight(row)];
        for (tare, change) in self.tare_sums.iter_mut().zip(changes) {
            *tare = tare.wrapping_add(change);
        }
        (line.tare_sum, line.tare_moment) = (sum, moment);
    }
}

/// Sum and moment of a row's taxels.
fn row_sums(taxels: &[i32; COLUMNS]) -> [i32; 2] {
    let (mut sum, mut moment) = (0, 0);
    for (column, taxel) in taxels.iter().enumerate() {
        sum += taxel;
        moment += taxel * row::weight(column);
    }
    [sum, moment]
}

/// Every place in turn, written out: the compiler would keep the loop where it builds for size.
#[inline(always)]
fn each(mut act: impl FnMut(usize) -> u32) -> Pairs {
    [act(0), act(1), act(2), act(3), act(4)]
}
