//! What the array makes of pressures: rounding, noise and dead taxels.

use super::{CODES_PER_KPA, Pressures};
use core::f64::consts::TAU;
use fastrand::Rng;
use fingertip::shipped::{COLUMNS, Picture, ROWS};

/// A normal deviate.
fn normal(rng: &mut Rng) -> f64 {
    (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (TAU * rng.f64()).cos()
}

/// How readings are rounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Steps {
    /// To the nearest sixteenth of a code, the pipeline's own step.
    Sixteenths,
    /// Down to a whole code, as a 12-bit converter does without noise.
    Codes,
}

/// What readings suffer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Nothing.
    None,
    /// Each taxel's own reading times this, normally distributed.
    OfReading(f64),
    /// The highest reading times this, normally distributed, on every taxel.
    OfPeak(f64),
}

/// How pressures become a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Rounding.
    pub steps: Steps,
    /// Noise.
    pub noise: Noise,
    /// Dead taxels, drawn at random.
    pub dead: usize,
}

impl Reading {
    /// Dead taxels, drawn at random: a bit for each column, for each row.
    pub fn dead(&self, rng: &mut Rng) -> [u32; ROWS] {
        let mut bad = [0_u32; ROWS];
        let mut left = self.dead;
        while left > 0 {
            let (row, column) = (rng.usize(..ROWS), rng.usize(..COLUMNS));
            left -= usize::from(bad[row] >> column & 1 == 0);
            bad[row] |= 1 << column;
        }
        bad
    }

    /// The picture of pressures on the taxels that are not bad, and how many of these see the contact: those with
    /// pressure before noise.
    pub fn picture(&self, pressures: &Pressures, bad: [u32; ROWS], rng: &mut Rng) -> (Picture, usize) {
        let peak = pressures.iter().flatten().fold(0.0, |peak: f64, kpa| peak.max(*kpa));
        let mut seen = 0;
        let mut taxels = [[0; COLUMNS]; ROWS];
        for (row, line) in pressures.iter().enumerate() {
            for (column, kpa) in line.iter().enumerate() {
                if bad[row] >> column & 1 != 0 {
                    continue;
                }
                seen += usize::from(*kpa > 0.0);
                let noisy = match self.noise {
                    Noise::None => *kpa,
                    Noise::OfReading(share) => kpa * (1.0 + share * normal(rng)),
                    Noise::OfPeak(share) => kpa + peak * share * normal(rng),
                };
                taxels[row][column] = match self.steps {
                    Steps::Sixteenths => (noisy * CODES_PER_KPA * 16.0).round() as i32,
                    Steps::Codes => (noisy * CODES_PER_KPA).floor() as i32 * 16,
                };
            }
        }
        (picture(&taxels, bad), seen)
    }
}

/// A picture of these taxels with its sums, as the pipeline makes it; bad taxels read 0.
pub fn picture(taxels: &[[i32; COLUMNS]; ROWS], bad: [u32; ROWS]) -> Picture {
    let mut picture = Picture { taxels: *taxels, bad, ..Picture::EMPTY };
    for (row, line) in picture.taxels.iter_mut().enumerate() {
        for (column, taxel) in line.iter_mut().enumerate() {
            if bad[row] >> column & 1 != 0 {
                *taxel = 0;
                picture.bad_count += 1;
            }
            picture.sum += *taxel;
            picture.moment_x += *taxel * (2 * column as i32 + 1 - COLUMNS as i32);
            picture.moment_y += *taxel * (2 * row as i32 + 1 - ROWS as i32);
            picture.peak = picture.peak.max(*taxel);
        }
    }
    picture
}
