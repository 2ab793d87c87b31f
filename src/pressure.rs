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
#[derive(Clone, Debug)]
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
        let picture = &mut self.picture;
        *picture = Picture::EMPTY;
        picture.undriven_max = undriven_a.iter().chain(undriven_b).copied().max().unwrap_or(0);

        let mut columns = [0; COLUMNS];
        let mut weight = 1 - ROWS as i32;
        let places = picture.taxels.iter_mut().zip(&mut picture.bad);
        let calibrations = self.tare.iter().zip(&self.gain);
        for ((codes, calibration), (out, bad)) in rows_a.iter().zip(rows_b).zip(calibrations).zip(places) {
            let net = net_codes(codes.0, codes.1, undriven_a, undriven_b);
            let boost = sag_boost(net.iter().map(|net| u32::from(*net)).sum(), config.sag_q32);
            let live = live_columns(codes.0, codes.1, &net, config.dead_codes);
            *bad = !live & COLUMN_MASK;
            let mut row_sum = 0;
            let taxels = out.iter_mut().zip(&mut columns).zip(net).zip(calibration.0.iter().zip(calibration.1));
            for (place, (((out, column), net), (tare, gain))) in taxels.enumerate() {
                if live >> place & 1 == 0 {
                    continue;
                }
                let corrected = (u32::from(net) * boost + (1 << 11)) >> (16 - CODE_BITS);
                let value = ((corrected * u32::from(*gain)) >> 14) as i32 - (tare >> (TARE_BITS - CODE_BITS));
                *out = value;
                *column += value;
                row_sum += value;
                picture.peak = picture.peak.max(value);
            }
            picture.sum += row_sum;
            picture.moment_y += row_sum * weight;
            weight += 2;
        }
        picture.bad_count = picture.bad.iter().map(|bad| bad.count_ones() as u8).sum();
        picture.moment_x =
            columns.iter().zip((1 - COLUMNS as i32..).step_by(2)).map(|(sum, weight)| sum * weight).sum();
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

const COLUMN_MASK: u16 = (1 << COLUMNS) - 1;

/// Moves each tare (Q16) by `weight` (Q16) of what the taxel now reads above it.
fn learn(tares: &mut [i32; COLUMNS], values: &[i32; COLUMNS], weight: i32) {
    for (tare, value) in tares.iter_mut().zip(values) {
        *tare += ((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32;
    }
}

/// Codes above the columns' undriven level, never below 0.
fn net_codes(
    codes_a: &[u16; BANK_COLUMNS],
    codes_b: &[u16; BANK_COLUMNS],
    undriven_a: &[u16; BANK_COLUMNS],
    undriven_b: &[u16; BANK_COLUMNS],
) -> [u16; COLUMNS] {
    let mut net = [0; COLUMNS];
    let codes = codes_a.iter().chain(codes_b).zip(undriven_a.iter().chain(undriven_b));
    for (net, (code, undriven)) in net.iter_mut().zip(codes) {
        *net = (code & 0xfff).saturating_sub(*undriven);
    }
    net
}

/// A bit for each column whose taxel is neither dead nor saturated.
fn live_columns(
    codes_a: &[u16; BANK_COLUMNS],
    codes_b: &[u16; BANK_COLUMNS],
    net: &[u16; COLUMNS],
    dead_codes: u16,
) -> u16 {
    let codes = codes_a.iter().chain(codes_b).zip(net);
    codes
        .enumerate()
        .fold(0, |live, (place, (code, net))| live | u16::from(*code < SATURATED && *net >= dead_codes) << place)
}

/// 1 / (1 - rho N) in Q16, at most 2: a row that loses half its voltage is broken, not sagging.
fn sag_boost(row_codes: u32, sag_q32: u32) -> u32 {
    let remaining = (u32::MAX - row_codes.saturating_mul(sag_q32)) >> 16;
    u32::MAX / remaining.max(1 << 15)
}
