//! The reading without contact: measured at once by a tare, followed slowly by the baseline.

use super::{Array, CODE_BITS, Picture, TARE_BITS, row};

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

    /// Lets the baseline learn a share (Q16) of what the next row reads above it. [`crate::touch::Touch::learns`] gives
    /// the share, where there is one.
    ///
    /// Returns the share of the baseline that this renewed, Q16: with a round's last row that of the round, else 0.
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
