//! Codes to pressures: column offsets, the driven row's sag, tare, gain, and the health of every taxel.
//!
//! A column shows `n = K G / (1 + R_on S)` codes above its undriven level, where S is the sum of the driven row's
//! conductances and K the front end's codes per siemens. The row's own sum of codes N = K S / (1 + R_on S) therefore
//! tells the sag exactly: 1 + R_on S = 1 / (1 - rho N) with rho = R_on / K. So `m = n / (1 - rho N)` is what the
//! taxel would show behind a perfect row driver, and m times the taxel's gain, less its tare, is its pressure.

mod calibration;
mod row;

pub use calibration::{Calibration, CalibrationError};

use crate::config::Config;
use crate::frame::{COLUMNS, Frame, ROWS};
use row::{Columns, Row};

/// Fractional bits of a corrected code.
pub const CODE_BITS: u32 = 4;
/// Fractional bits of the tare: the baseline's filter needs steps far below one code.
const TARE_BITS: u32 = 16;
/// Frames averaged by a tare.
pub const TARE_FRAMES: u32 = 64;
/// Weight of a frame in the baseline, Q16; each row is visited every tenth frame, so the time constant is 10,240 frames.
const BASELINE_WEIGHT: i32 = 64;
/// Per-taxel gain of one, Q14. Gains reach from 0 to just below 2.
pub const GAIN_ONE: u16 = 1 << 14;
/// Largest gain.
pub const GAIN_MAX: u16 = (1 << 15) - 1;

/// The array's readings above tare and what they add up to, in sixteenths of a corrected code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Picture {
    /// `taxels[row][column]`, zero where the taxel is masked, dead or saturated.
    pub taxels: [[i32; COLUMNS]; ROWS],
    /// Sum over all taxels.
    pub sum: i32,
    /// Sum weighted by twice the column's distance from the middle, in pitches: -9, -7 .. 9.
    pub moment_x: i32,
    /// Sum weighted by twice the row's distance from the middle, in pitches.
    pub moment_y: i32,
    /// Largest taxel.
    pub peak: i32,
    /// A bit for each column that is masked, dead or saturated, for each row.
    pub bad: [u16; ROWS],
    /// Taxels that are dead or saturated, and not masked.
    pub bad_count: u8,
    /// The highest undriven column level, codes.
    pub undriven_max: u16,
}

impl Picture {
    /// Nothing seen.
    pub const EMPTY: Self = Self {
        taxels: [[0; COLUMNS]; ROWS],
        sum: 0,
        moment_x: 0,
        moment_y: 0,
        peak: 0,
        bad: [0; ROWS],
        bad_count: 0,
        undriven_max: 0,
    };
}

/// Per-taxel calibration and the last picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Array {
    picture: Picture,
    /// Reading without contact, codes in Q16.
    tare: [[i32; COLUMNS]; ROWS],
    calibration: Calibration,
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
            tare: [[0; COLUMNS]; ROWS],
            calibration: Calibration::NONE,
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

    /// Reads a frame. Any codes are taken: what a sound array cannot show becomes a bad taxel.
    pub fn read(&mut self, frame: &Frame, config: &Config) -> &Picture {
        let [rows @ .., undriven] = &frame.pairs;
        let levels = &undriven.map(row::held);
        let picture = &mut self.picture;
        let (mut sum, mut moment_x, mut moment_y, mut peak) = (0, 0, 0, 0);
        let mut bad_count = 0;
        let mut weight = 1 - ROWS as i32;
        let calibrations = self.calibration.gain.iter().zip(&self.calibration.mask);
        let places = picture.taxels.iter_mut().zip(&mut picture.bad);
        for (((codes, tare), (gain, mask)), (out, bad)) in rows.iter().zip(&self.tare).zip(calibrations).zip(places) {
            let row = Row::of(codes, levels, config.dead_codes);
            let columns = if row.suspect {
                let (columns, found) = row::read_suspect([codes, levels], *mask, tare, gain, config, out);
                *bad = found | mask;
                bad_count += (found & !mask).count_ones() as u8;
                columns
            } else {
                *bad = *mask;
                Columns::read(&row, 0, tare, gain, config.sag_q32, out)
            };
            peak = i32::max(peak, columns.peak);
            sum += columns.sum();
            moment_x += columns.moment();
            moment_y += columns.sum() * weight;
            weight += 2;
        }
        picture.sum = sum;
        picture.moment_x = moment_x;
        picture.moment_y = moment_y;
        picture.peak = peak;
        picture.bad_count = bad_count;
        picture.undriven_max = undriven.iter().fold(0, |max, pair| max.max(*pair as u16).max((*pair >> 16) as u16));
        picture
    }

    /// Taxels that a frame shows as dead or saturated, masked ones aside: [`Array::read`] without the readings, and quicker.
    pub fn bad_taxels(&self, frame: &Frame, config: &Config) -> u32 {
        let [rows @ .., undriven] = &frame.pairs;
        let levels = &undriven.map(row::held);
        let mut count = 0;
        for (codes, mask) in rows.iter().zip(&self.calibration.mask) {
            let row = Row::of(codes, levels, config.dead_codes);
            if row.suspect {
                count += (row.bad(codes, config.dead_codes) & !mask).count_ones();
            }
        }
        count
    }

    /// Replaces the calibration; the tare, which was measured with the old one, is forgotten.
    pub fn calibrate(&mut self, calibration: &Calibration) {
        self.calibration = calibration.clone();
        self.start_tare();
    }

    /// Forgets the tare and starts to measure it anew.
    pub fn start_tare(&mut self) {
        self.tare = [[0; COLUMNS]; ROWS];
        self.tare_frames = 0;
    }

    /// Takes the picture last read into the tare's running mean; true when the tare is complete.
    pub fn continue_tare(&mut self) -> bool {
        self.tare_frames += 1;
        let weight = (1 << 16) / self.tare_frames.clamp(1, TARE_FRAMES) as i32;
        for (tares, values) in self.tare.iter_mut().zip(&self.picture.taxels) {
            learn(tares, values, weight);
        }
        self.tare_frames >= TARE_FRAMES
    }

    /// Lets the baseline follow the picture, one row a frame; call it only where there is no contact.
    pub fn follow_drift(&mut self) {
        self.baseline_row = if self.baseline_row + 1 < ROWS { self.baseline_row + 1 } else { 0 };
        if let (Some(tares), Some(values)) =
            (self.tare.get_mut(self.baseline_row), self.picture.taxels.get(self.baseline_row))
        {
            learn(tares, values, BASELINE_WEIGHT);
        }
    }
}

/// Moves each tare (Q16) by `weight` (Q16) of what the taxel now reads above it. It wraps only for codes that no converter of 12 bits
/// gives.
fn learn(tares: &mut [i32; COLUMNS], values: &[i32; COLUMNS], weight: i32) {
    for (tare, value) in tares.iter_mut().zip(values) {
        *tare = tare.wrapping_add(((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32);
    }
}
