//! Codes to pressures: column offsets, the driven row's sag, tare, gain, and the health of every taxel.
//!
//! A column shows `n = K G / (1 + R_on S)` codes above its undriven level, where S is the sum of the driven row's
//! conductances and K the front end's codes per siemens. The row's own sum of codes N = K S / (1 + R_on S) therefore
//! tells the sag exactly: 1 + R_on S = 1 / (1 - rho N) with rho = R_on / K. So `m = n / (1 - rho N)` is what the
//! taxel would show behind a perfect row driver, and m times the taxel's gain, less its tare, is its pressure.

use crate::config::Config;
use crate::frame::{BANK_COLUMNS, COLUMNS, Frame, ROWS, SATURATED};

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
    /// `taxels[row][column]`, zero where the taxel is dead or saturated.
    pub taxels: [[i32; COLUMNS]; ROWS],
    /// Sum over all taxels.
    pub sum: i32,
    /// Sum weighted by twice the column's distance from the middle, in pitches: -9, -7 .. 9.
    pub moment_x: i32,
    /// Sum weighted by twice the row's distance from the middle, in pitches.
    pub moment_y: i32,
    /// Largest taxel.
    pub peak: i32,
    /// A bit for each bad column, for each row.
    pub bad: [u16; ROWS],
    /// Taxels that are dead or saturated.
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
    gain: [[u16; COLUMNS]; ROWS],
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
            gain: [[GAIN_ONE; COLUMNS]; ROWS],
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
        let [[rows_a @ .., undriven_a], [rows_b @ .., undriven_b]] = &frame.banks;
        let undriven = joined(undriven_a, undriven_b);
        let picture = &mut self.picture;
        let (mut sum, mut moment_x, mut moment_y, mut peak) = (0, 0, 0, 0);
        let mut bad_count = 0;
        let mut weight = 1 - ROWS as i32;
        let codes = rows_a.iter().zip(rows_b);
        let calibrations = self.tare.iter().zip(&self.gain);
        let places = picture.taxels.iter_mut().zip(&mut picture.bad);
        for (((codes_a, codes_b), (tare, gain)), (out, bad)) in codes.zip(calibrations).zip(places) {
            let codes = joined(codes_a, codes_b);
            let mut row = Row::of(&codes, &undriven, config.dead_codes);
            *bad = 0;
            if row.suspect {
                *bad = row.leave_out_bad(&codes, config.dead_codes);
                bad_count += bad.count_ones() as u8;
            }
            let boost = sag_boost(row.sum, config.sag_q32);
            let mut row_sum = 0;
            for column in 0..COLUMNS {
                let corrected = row.net[column].wrapping_mul(boost).wrapping_add(1 << 11) >> (16 - CODE_BITS);
                let gained = (corrected.wrapping_mul(u32::from(gain[column])) >> 14) as i32;
                let mut value = gained - (tare[column] >> (TARE_BITS - CODE_BITS));
                if row.suspect && *bad >> column & 1 != 0 {
                    value = 0;
                }
                out[column] = value;
                row_sum += value;
                moment_x += value * WEIGHTS[column];
                peak = i32::max(peak, value);
            }
            sum += row_sum;
            moment_y += row_sum * weight;
            weight += 2;
        }
        picture.sum = sum;
        picture.moment_x = moment_x;
        picture.moment_y = moment_y;
        picture.peak = peak;
        picture.bad_count = bad_count;
        picture.undriven_max = undriven.iter().fold(0, |max, level| if *level > max { *level } else { max });
        picture
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

/// Twice a column's distance from the middle, in pitches.
const WEIGHTS: [i32; COLUMNS] = [-9, -7, -5, -3, -1, 1, 3, 5, 7, 9];

/// One driven row, before calibration.
struct Row {
    /// Codes above the columns' undriven levels.
    net: [u32; COLUMNS],
    /// Their sum.
    sum: u32,
    /// A taxel is dead or saturated.
    suspect: bool,
}

impl Row {
    /// Without a branch for each taxel: one sign bit collects what is wrong with any of them.
    fn of(codes: &[u16; COLUMNS], undriven: &[u16; COLUMNS], dead_codes: u16) -> Self {
        let mut net = [0; COLUMNS];
        let mut sum = 0u32;
        let mut sign = 0;
        for column in 0..COLUMNS {
            let (code, level) = (i32::from(codes[column]), i32::from(undriven[column]));
            sign |= (code - level - i32::from(dead_codes)) | (i32::from(SATURATED) - 1 - code);
            net[column] = (code - level) as u32;
            sum = sum.wrapping_add(net[column]);
        }
        Self { net, sum, suspect: sign < 0 }
    }

    /// Holds every net code to what a converter can mean, and tells the bad columns, a bit each.
    #[cold]
    fn leave_out_bad(&mut self, codes: &[u16; COLUMNS], dead_codes: u16) -> u16 {
        let mut bad = 0;
        self.sum = 0;
        for (column, (net, code)) in self.net.iter_mut().zip(codes).enumerate() {
            *net = (*net as i32).clamp(0, 0xfff) as u32;
            self.sum += *net;
            bad |= u16::from(*code >= SATURATED || *net < u32::from(dead_codes)) << column;
        }
        bad
    }
}

/// Moves each tare (Q16) by `weight` (Q16) of what the taxel now reads above it.
fn learn(tares: &mut [i32; COLUMNS], values: &[i32; COLUMNS], weight: i32) {
    for (tare, value) in tares.iter_mut().zip(values) {
        *tare += ((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32;
    }
}

/// The columns of both banks.
fn joined(a: &[u16; BANK_COLUMNS], b: &[u16; BANK_COLUMNS]) -> [u16; COLUMNS] {
    let mut columns = [0; COLUMNS];
    columns[..BANK_COLUMNS].copy_from_slice(a);
    columns[BANK_COLUMNS..].copy_from_slice(b);
    columns
}

/// 1 / (1 - rho N) in Q16, at most 2: a row that loses half its voltage is broken, not sagging.
fn sag_boost(row_codes: u32, sag_q32: u32) -> u32 {
    let remaining = (u32::MAX - row_codes.saturating_mul(sag_q32)) >> 16;
    u32::MAX / remaining.max(1 << 15)
}
