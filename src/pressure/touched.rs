//! Whether something touched the tip during a tare.
//!
//! A contact is a patch: some rows carry more than the rest. What taxels differ by without one, gains, preload and
//! amplifiers, is each taxel's own, so it averages out over a row, where a contact adds up. The row that carries most
//! is held against the one that carries least.
//!
//! Against a clean tare before, it must carry more by half of what begins a contact. Without one only the shape is
//! known, and preload may lie unevenly: then it must carry half as much again as the other, too.

use super::Array;
use crate::config::Config;

/// What each row would carry if all of its taxels were good, in sixteenths of a corrected code; none where too few are.
type Lines<const ROWS: usize> = [Option<i32>; ROWS];

/// What a tare says of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Touched<const ROWS: usize> {
    /// Something touched during the last tare.
    pub flag: bool,
    /// The last tare without a contact.
    clean: Option<Lines<ROWS>>,
}

impl<const ROWS: usize> Touched<ROWS> {
    /// Nothing known.
    pub const NONE: Self = Self { flag: false, clean: None };
}

impl<const ROWS: usize, const COLUMNS: usize> Array<ROWS, COLUMNS> {
    /// A row tells what a taxel usually carries where at least so many of its taxels are good: half of them.
    const ROW_LEAST: u32 = COLUMNS as u32 / 2;

    /// Whether something seems to have touched the tip during the last tare that was judged.
    pub fn tared_touching(&self) -> bool {
        self.touched.flag
    }

    /// Judges the tare that was just completed.
    #[inline(never)]
    pub fn judge_tare(&mut self, config: &Config) {
        let mut now: Lines<ROWS> = [None; ROWS];
        for ((now, [line, _]), bad) in now.iter_mut().zip(self.tare_lines).zip(self.picture.bad) {
            let good = (COLUMNS as u32).saturating_sub(bad.count_ones());
            *now = (good >= Self::ROW_LEAST).then(|| line.wrapping_mul(COLUMNS as i32) / good.max(1).cast_signed());
        }
        let clean = self.touched.clean.unwrap_or([Some(0); ROWS]);
        let (mut most, mut least) = (i32::MIN, i32::MAX);
        for (now, clean) in now.into_iter().zip(clean) {
            if let (Some(now), Some(clean)) = (now, clean) {
                let more = now.saturating_sub(clean);
                (most, least) = (most.max(more), least.min(more));
            }
        }
        let uneven = if self.touched.clean.is_some() { 0 } else { least / 2 };
        self.touched.flag = most > least && most.saturating_sub(least) > config.touch_line.max(uneven);
        if !self.touched.flag {
            self.touched.clean = Some(now);
        }
    }
}
