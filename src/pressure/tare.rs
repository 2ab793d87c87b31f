//! The reading without contact: measured at once by a tare, followed slowly by the baseline.

use super::{Array, CODE_BITS, Picture, TARE_BITS, row};
use crate::units::Newtons;

/// Weight of a frame in the baseline, Q16; of ten rows each is visited every tenth frame, so the time constant is
/// 10,240 frames.
const BASELINE_WEIGHT: i32 = 64;

/// The first frames after a contact are weighed as if so many had come before.
const CLEAR_ROUNDS_FIRST: i32 = 4;
/// For so many rounds a clear tip may read what is left of a contact: of ten rows 0.26 s. By then it is learnt.
const LEFT_ROUNDS: i32 = 256;
/// What is left of a force is at most this share of it: a quarter.
const LEFT_BITS: u32 = 2;

impl<const ROWS: usize, const COLUMNS: usize> Array<ROWS, COLUMNS> {
    /// Frames of a tare: of ten rows 160, 16 ms at 10 kHz.
    ///
    /// Each learns two rows, so that it takes no longer than a frame in contact, and each row is learned 32 times: that
    /// leaves 0.18 of a reading's white noise in a taxel's tare, and the sums, which every frame adds to, 0.08 of ten
    /// rows.
    pub const TARE_FRAMES: u32 = 32 * Self::TARE_STRIDE;
    /// Frames until a tare comes to the same row again, and from the one row of a frame to the other.
    const TARE_STRIDE: u32 = ROWS.div_ceil(2) as u32;

    /// Forgets the tare and starts to measure it anew.
    pub fn start_tare(&mut self) {
        self.rows.iter_mut().for_each(|row| row.tare = [0; COLUMNS]);
        self.tare_lines = [[0; 2]; ROWS];
        self.tare_sums = [0; 3];
        self.tare_frames = 0;
        self.baseline_line = None;
        self.held = Newtons::ZERO;
    }

    /// Another characteristic may count from now on.
    pub fn forget_line(&mut self) {
        self.baseline_line = None;
    }

    /// Takes the picture last read into the tare's running means; true when the tare is complete.
    pub fn continue_tare(&mut self) -> bool {
        let (visits, first) = (self.tare_frames / Self::TARE_STRIDE, self.tare_frames % Self::TARE_STRIDE);
        self.tare_frames = (self.tare_frames + 1).min(Self::TARE_FRAMES);
        let weight = i64::from((1 << 16) / self.tare_frames.max(1));
        // The sums are not rounded taxel by taxel, so they have a mean of their own.
        let Picture { sum, moment_x, moment_y, .. } = self.picture;
        let mut tare_sums = self.tare_sums;
        for (tare, value) in tare_sums.iter_mut().zip([sum, moment_x, moment_y]) {
            *tare = tare.wrapping_add(((i64::from(value) * weight + (1 << 15)) >> 16) as i32);
        }
        for row in [first, first + Self::TARE_STRIDE] {
            // Of an odd number of rows the last frame of a round learns one.
            if ROWS.is_multiple_of(2) || row < ROWS as u32 {
                self.learn(row as usize, ((1 << 16) / (visits + 1)) as i32);
            }
        }
        self.tare_sums = tare_sums;
        self.tare_frames >= Self::TARE_FRAMES
    }

    /// Lets the baseline follow the picture, one row a frame; call it only where there is no contact. Where the tip is
    /// surely clear, the first frames after a contact count most: the mean of all since then, until they are as many as
    /// the filter holds. So what creep, warmth and hysteresis left is gone in a tenth of a second.
    ///
    /// Gives what share of the baseline this learnt anew, Q16: with a round's last row that of the round, else 0.
    pub fn follow_drift(&mut self, clear: bool) -> i32 {
        let quick = (1 << 16) / (self.clear_rounds.max(0) + CLEAR_ROUNDS_FIRST);
        let weight = if clear { quick.max(BASELINE_WEIGHT) } else { BASELINE_WEIGHT };
        self.learn(self.baseline_row, weight);
        self.baseline_row = if self.baseline_row + 1 < ROWS { self.baseline_row + 1 } else { 0 };
        if self.baseline_row != 0 {
            return 0;
        }
        if clear {
            self.clear_rounds = (self.clear_rounds + 1).min(1 << 16);
        }
        weight
    }

    /// A frame of a clear tip that is not learnt from: what comes later is another touch.
    pub fn pass(&mut self) {
        self.baseline_row = if self.baseline_row + 1 < ROWS { self.baseline_row + 1 } else { 0 };
        if self.baseline_row == 0 {
            self.clear_rounds = (self.clear_rounds + 1).min(1 << 16);
        }
    }

    /// Something is touched with this force: the baseline that it leaves is learnt anew.
    pub fn touched(&mut self, force: Newtons) {
        let before = if self.clear_rounds < LEFT_ROUNDS { self.held } else { Newtons::ZERO };
        self.held = before.max(force);
        self.clear_rounds = 0;
    }

    /// Whether what a tip that stands clear reads may be left of what it held: soon after, and at most a quarter of it.
    /// All else is another touch, as of something that was moved along.
    pub fn may_be_left(&self, force: Newtons) -> bool {
        self.clear_rounds < LEFT_ROUNDS && force.0 <= self.held.0 >> LEFT_BITS
    }

    /// Moves each tare of a row by `weight` (Q16) of what the taxel now reads above it. It wraps only for codes that no
    /// converter of 12 bits gives.
    fn learn(&mut self, row: usize, weight: i32) {
        let row = row.min(ROWS - 1);
        let (mut sum, mut moment) = (0, 0);
        let values = self.baseline_line.as_ref().unwrap_or(&self.picture.taxels[row]);
        for (column, (tare, value)) in self.rows[row].tare.iter_mut().zip(values).enumerate() {
            *tare = tare.wrapping_add(((i64::from(*value) * i64::from(weight)) >> CODE_BITS) as i32);
            let tare = *tare >> (TARE_BITS - CODE_BITS);
            sum += tare;
            moment += tare * row::weight(column, COLUMNS);
        }
        let [line, line_x] = &mut self.tare_lines[row];
        let more = sum - *line;
        let [all, all_x, all_y] = &mut self.tare_sums;
        *all = all.wrapping_add(more);
        *all_x = all_x.wrapping_add(moment - *line_x);
        *all_y = all_y.wrapping_add(more * row::weight(row, ROWS));
        (*line, *line_x) = (sum, moment);
    }
}
