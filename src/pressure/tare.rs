//! The reading without contact: measured at once by a tare, followed slowly by the baseline.
//!
//! # Touch during a tare
//!
//! A contact is a patch: some rows carry more than the rest. Gains, preload and amplifiers differ from taxel to taxel,
//! so their differences average out over a row, where a contact adds up. The row that carries most is compared with the
//! row that carries least.
//!
//! Compared with a clean tare before, it must carry more by half of what begins a contact. Without a clean tare only
//! the shape is known, and preload may be uneven: then it must also carry half as much again as the other row.

use super::{Array, CODE_BITS, TARE_BITS, TactileImage};
use crate::config::Config;

impl<const ROWS: usize, const COLUMNS: usize> Array<ROWS, COLUMNS> {
    /// Number of frames of a tare: 160 with ten rows, 16 ms at 10 kHz.
    ///
    /// Each frame learns two rows, so that it takes no longer than a frame in contact, and each row is learned 32
    /// times. That leaves 0.18 of a reading's white noise in a taxel's tare, and 0.08 with ten rows in the sums,
    /// which every frame adds to.
    pub const TARE_FRAMES: u32 = 32 * Self::TARE_STRIDE;
    /// Frames between two visits of the same row during a tare. A frame reads two rows, this far apart.
    const TARE_STRIDE: u32 = ROWS.div_ceil(2) as u32;

    /// Drops the tare and starts to measure it again. What a released (`free`) tip reads now is a residue of its contact.
    pub fn start_tare(&mut self, free: bool) {
        self.touched.residue = free.then(|| {
            (0..ROWS).for_each(|row| self.learn(row, 1 << 16));
            self.lines()
        });
        self.rows.iter_mut().for_each(|row| row.tare = [0; COLUMNS]);
        self.tare_lines = [[0; 2]; ROWS];
        self.tare_sums = [0; 3];
        self.tare_frames = 0;
    }

    /// Adds the last image to the tare's running means. Returns true when the tare is complete.
    pub fn continue_tare(&mut self) -> bool {
        let (visits, first) = (self.tare_frames / Self::TARE_STRIDE, self.tare_frames % Self::TARE_STRIDE);
        self.tare_frames = (self.tare_frames + 1).min(Self::TARE_FRAMES);
        let weight = i64::from((1 << 16) / self.tare_frames.max(1));
        // The sums are not rounded taxel by taxel, so they have a mean of their own.
        let TactileImage { sum, moment_x, moment_y, .. } = self.picture;
        let mut tare_sums = self.tare_sums;
        for (tare, value) in tare_sums.iter_mut().zip([sum, moment_x, moment_y]) {
            *tare = tare.wrapping_add(((i64::from(value) * weight + (1 << 15)) >> 16) as i32);
        }
        for row in [first, first + Self::TARE_STRIDE] {
            // With an odd number of rows the last frame of a round learns one.
            if ROWS.is_multiple_of(2) || row < ROWS as u32 {
                self.learn(row as usize, ((1 << 16) / (visits + 1)) as i32);
            }
        }
        self.tare_sums = tare_sums;
        self.tare_frames >= Self::TARE_FRAMES
    }

    /// Lets the baseline learn a share (Q16) of the next row's reading above it. [`crate::touch::Touch::learns`]
    /// gives the share.
    ///
    /// Returns the share of the baseline that this renewed, Q16: that of the round with its last row, else 0.
    pub fn follow_drift(&mut self, weight: u32) -> i32 {
        let weight = weight.min(1 << 16).cast_signed();
        self.learn(self.baseline_row, weight);
        self.baseline_row = if self.baseline_row + 1 < ROWS { self.baseline_row + 1 } else { 0 };
        if self.baseline_row == 0 { weight } else { 0 }
    }

    /// Moves each tare of a row by `weight` (Q16) of what the taxel now reads above it. It wraps only for codes that no
    /// converter of 12 bits gives.
    fn learn(&mut self, row: usize, weight: i32) {
        let row = row.min(ROWS - 1);
        let (mut sum, mut moment) = (0, 0);
        let mut readings = [0; COLUMNS];
        let values = if self.loads {
            for (column, reading) in readings.iter_mut().enumerate() {
                *reading = if self.picture.bad[row] >> column & 1 == 0 { self.rows[row].reading(column) } else { 0 };
            }
            &readings
        } else {
            &self.picture.taxels[row]
        };
        for (column, (tare, value)) in self.rows[row].tare.iter_mut().zip(values).enumerate() {
            *tare = tare.wrapping_add(((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32);
            let tare = *tare >> (TARE_BITS - CODE_BITS);
            sum += tare;
            moment += tare * super::weight(column, COLUMNS);
        }
        let [line, line_x] = &mut self.tare_lines[row];
        let more = sum - *line;
        let [all, all_x, all_y] = &mut self.tare_sums;
        *all = all.wrapping_add(more);
        *all_x = all_x.wrapping_add(moment - *line_x);
        *all_y = all_y.wrapping_add(more * super::weight(row, ROWS));
        (*line, *line_x) = (sum, moment);
    }
}

/// Load of each row if all of its taxels were good, in sixteenths of a corrected code; none for a row with too few
/// good taxels.
type Lines<const ROWS: usize> = [Option<i32>; ROWS];

/// Evidence of a touch during a tare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Touched<const ROWS: usize> {
    /// True if something touched during the last tare.
    pub flag: bool,
    /// Rows of the last tare without a contact.
    clean: Option<Lines<ROWS>>,
    /// Rows when the tare of a released tip began.
    residue: Option<Lines<ROWS>>,
}

impl<const ROWS: usize> Touched<ROWS> {
    /// State before the first tare.
    pub const NONE: Self = Self { flag: false, clean: None, residue: None };
}

impl<const ROWS: usize, const COLUMNS: usize> Array<ROWS, COLUMNS> {
    /// Least number of good taxels in a row that is judged: half of its taxels.
    const ROW_LEAST: u32 = COLUMNS as u32 / 2;

    /// Returns true if something seems to have touched the tip during the last tare that was judged.
    pub fn tared_touching(&self) -> bool {
        self.touched.flag
    }

    /// Returns the load of each row by the tare.
    fn lines(&self) -> Lines<ROWS> {
        let mut lines = [None; ROWS];
        for ((loaded, [line, _]), bad) in lines.iter_mut().zip(self.tare_lines).zip(self.picture.bad) {
            let good = (COLUMNS as u32).saturating_sub(bad.count_ones());
            *loaded = (good >= Self::ROW_LEAST).then(|| line.wrapping_mul(COLUMNS as i32) / good.max(1).cast_signed());
        }
        lines
    }

    /// Judges the tare that was just completed. A residue can only fade meanwhile, and is no reference for later tares.
    #[inline(never)]
    pub fn judge_tare(&mut self, config: &Config) {
        let Touched { clean, residue, .. } = self.touched;
        let now = self.lines();
        let before = residue.or(clean).unwrap_or([Some(0); ROWS]);
        let (mut most, mut least) = (i32::MIN, i32::MAX);
        for (now, before) in now.into_iter().zip(before) {
            if let (Some(now), Some(before)) = (now, before) {
                let more = now.saturating_sub(before);
                (most, least) = (most.max(more), least.min(more));
            }
        }
        if residue.is_some() {
            least = 0;
        }
        let uneven = if clean.is_some() { 0 } else { least / 2 };
        self.touched.flag = most > least && most.saturating_sub(least) > config.touch_line.max(uneven);
        if !self.touched.flag && residue.is_none() {
            self.touched.clean = Some(now);
        }
    }
}
