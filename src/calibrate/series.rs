//! What a press leaves of every taxel: its mean reading in each of 24 steps of the travel.

use super::number::{BITS, clamped};
use crate::config::Config;
use crate::pressure::Picture;

/// Steps of the travel.
pub const STEPS: usize = 24;
/// More frames than this are not taken in a step: the sums stay within 32 bits.
const FRAMES_MAX: u16 = 4_096;
/// A step with fewer is left out.
const FRAMES_MIN: u16 = 3;
/// A reading beyond this is none: twice the highest code of a taxel.
const READING_MAX: i32 = (1 << 18) - 1;

/// Fractional bits of what a unit of a step's sums is, beyond those of a number.
const WHOLE_BITS: u32 = 13;

/// A number for each step.
pub type Series = [i64; STEPS];

/// The readings of a press. 9.8 KB for 10 x 10 taxels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Readings<const ROWS: usize, const COLUMNS: usize> {
    frames: [u16; STEPS],
    /// Sums of the way from the touch, Q24 mm.
    ways: [i64; STEPS],
    /// Sums of the readings, sixteenths of a corrected code; then their means as shares of Y, Q30.
    taxels: [[[i32; STEPS]; COLUMNS]; ROWS],
    /// A bit for each column that was bad in any frame.
    pub bad: [u32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Readings<ROWS, COLUMNS> {
    /// None yet.
    pub const NONE: Self =
        Self { frames: [0; STEPS], ways: [0; STEPS], taxels: [[[0; STEPS]; COLUMNS]; ROWS], bad: [0; ROWS] };

    /// Forgets a row; all have to be.
    pub fn clear(&mut self, row: usize) {
        (self.frames, self.ways, self.bad) = ([0; STEPS], [0; STEPS], [0; ROWS]);
        if let Some(row) = self.taxels.get_mut(row) {
            row.as_flattened_mut().fill(0);
        }
    }

    /// Takes a frame at a way from the touch, where the whole press goes so far, both Q24 mm.
    pub fn take(&mut self, way: i32, whole: i32, picture: &Picture<ROWS, COLUMNS>) {
        let step = (i64::from(way) * STEPS as i64).checked_div(whole.into()).unwrap_or(-1);
        let Ok(step) = usize::try_from(step) else { return };
        let (Some(frames), Some(ways)) = (self.frames.get_mut(step), self.ways.get_mut(step)) else { return };
        if *frames >= FRAMES_MAX {
            return;
        }
        *frames += 1;
        *ways += i64::from(way);
        for ((sums, taxels), (all, bad)) in
            self.taxels.iter_mut().zip(&picture.taxels).zip(self.bad.iter_mut().zip(&picture.bad))
        {
            *all |= bad;
            for (sums, taxel) in sums.iter_mut().zip(taxels) {
                if let Some(sum) = sums.get_mut(step) {
                    *sum = sum.saturating_add((*taxel).max(-READING_MAX).min(READING_MAX));
                }
            }
        }
    }

    /// Turns a taxel's sums into means, by what [`Readings::measure`] found.
    pub fn settle(&mut self, row: usize, column: usize, whole: &Series) {
        let Some(sums) = self.taxels.get_mut(row).and_then(|row| row.get_mut(column)) else { return };
        for (sum, part) in sums.iter_mut().zip(whole) {
            let share = (i64::from(*sum) * i64::from(*part as i32)) >> WHOLE_BITS;
            *sum = share.max((i32::MIN / 2).into()).min((i32::MAX / 2).into()) as i32;
        }
    }

    /// A taxel's means as shares of Y, Q30; 0 in steps that count not.
    pub fn of(&self, row: usize, column: usize) -> Series {
        let mut series = [0; STEPS];
        if let Some(means) = self.taxels.get(row).and_then(|row| row.get(column)) {
            series.iter_mut().zip(means).for_each(|(to, mean)| *to = i64::from(*mean));
        }
        series
    }

    /// Keeps in a taxel's place what was made of its means.
    pub fn keep(&mut self, row: usize, column: usize, words: [i32; 4]) {
        if let Some(means) = self.taxels.get_mut(row).and_then(|row| row.get_mut(column)) {
            means.iter_mut().zip(words).for_each(|(to, word)| *to = word);
        }
    }

    /// What is kept there.
    pub fn kept(&self, row: usize, column: usize) -> [i32; 4] {
        let mut words = [0; 4];
        if let Some(means) = self.taxels.get(row).and_then(|row| row.get(column)) {
            words.iter_mut().zip(means).for_each(|(to, mean)| *to = *mean);
        }
        words
    }

    /// How far a step's frames were from the touch in tip radii, Q30, where the step counts; and the share of Y that a unit
    /// of its sums is.
    pub fn measure(&self, step: usize, config: &Config) -> (Option<i64>, i64) {
        let (Some(frames), Some(ways)) = (self.frames.get(step), self.ways.get(step)) else { return (None, 0) };
        if *frames < FRAMES_MIN {
            return (None, 0);
        }
        let way = ways.checked_div((*frames).into()).unwrap_or(0);
        let travel = clamped((way * i64::from(config.geometry.inverse_radius)) >> (56 - BITS));
        // Q8 of the sixteenths over Q8: what the pressure Y shows.
        let whole = (i64::from(*frames) * i64::from(config.geometry.modulus_q8)) >> 8;
        let part = (1_i64 << (BITS + WHOLE_BITS)).checked_div(whole).unwrap_or(0);
        (Some(travel), part.min(i32::MAX.into()))
    }

    /// How many steps count.
    pub fn steps(&self) -> usize {
        self.frames.iter().filter(|frames| **frames >= FRAMES_MIN).count()
    }
}
