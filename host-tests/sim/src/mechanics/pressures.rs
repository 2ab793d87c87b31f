//! What each taxel feels of a contact, quick: its mean pressure depends only on the indentation and on where the contact's centre is.
//!
//! Means are worked out at the knots of a grid, once each and only where a contact comes by, and interpolated between them. The grid
//! runs in the square root of the indentation, in which the rim moves evenly, and holds the means as shares of the peak Y d / a, which
//! vary slowly. Cubic lines through four knots, with equal slopes where they meet (Catmull and Rom).

use super::shape;
use crate::effects::contact::Stages;
use fingertip::frame::{COLUMNS, ROWS};
use host_tests::plant::cells::Cell;
use host_tests::plant::setup::Tip;

/// A row's taxels.
type Row = [f64; COLUMNS];
/// Distance of knots in the square root of the indentation, sqrt(mm): the rim moves 0.07 mm from one to the next.
const ROOT: f64 = 1.0 / 64.0;
/// Distance of knots in the centre's place, mm.
const PLACE_MM: f64 = 0.125;
/// Knots on either side of the centre's place at rest.
const PLACES: usize = 64;

/// The means of one finger's taxels.
pub struct Pressures {
    tip: Tip,
    pitch_mm: f64,
    centre_mm: [f64; 2],
    deepest_mm: f64,
    knots: Vec<Vec<Option<Box<[Row; ROWS]>>>>,
}

/// Where between the knots a contact is: what a frame asks for row by row.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    root: [f64; 4],
    from: usize,
    place: [f64; 4],
    at: usize,
    peak_kpa: f64,
}

impl Pressures {
    /// Of a tip over an array whose middle is so far from the contact's centre.
    pub fn new(tip: Tip, pitch_mm: f64, centre_mm: [f64; 2]) -> Self {
        let deepest_mm = Tip::DEEPEST * tip.radius_mm;
        let roots = (deepest_mm.sqrt() / ROOT) as usize + 4;
        let knots = (0..roots).map(|_| vec![None; 2 * PLACES + 1]).collect();
        Self { tip, pitch_mm, centre_mm, deepest_mm, knots }
    }

    /// Means of one row at an indentation, with the centre shifted along the rows.
    pub fn row_kpa(&mut self, stages: &impl Stages, d_mm: f64, shift_mm: f64, row: usize) -> Row {
        if d_mm <= 0.0 {
            return [0.0; COLUMNS];
        }
        let place = self.place(d_mm, shift_mm);
        self.at(stages, &place, row)
    }

    fn place(&self, d_mm: f64, shift_mm: f64) -> Place {
        let d_mm = d_mm.min(self.deepest_mm);
        let (from, root) = weights(d_mm.sqrt() / ROOT);
        let steps = (shift_mm / PLACE_MM + PLACES as f64).clamp(1.0, 2.0 * PLACES as f64 - 2.0);
        let (at, place) = weights(steps);
        Place { root, from, place, at, peak_kpa: self.tip.modulus_kpa * d_mm / self.tip.radius_mm }
    }

    fn at(&mut self, stages: &impl Stages, place: &Place, row: usize) -> Row {
        let mut sum = [0.0; COLUMNS];
        for (j, along) in place.place.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
            for (i, weight) in place.root.iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
                // The shares are even in the root: the knot before the first is the one behind it.
                let root = (place.from + i).abs_diff(1);
                let weight = along * weight * place.peak_kpa;
                let knot = self.knot(stages, root, place.at + j - 1);
                for (sum, share) in sum.iter_mut().zip(&knot[row]) {
                    *sum += weight * share;
                }
            }
        }
        sum.map(|kpa| kpa.max(0.0))
    }

    fn knot(&mut self, stages: &impl Stages, root: usize, place: usize) -> &[Row; ROWS] {
        match &mut self.knots[root][place] {
            Some(knot) => knot,
            none => {
                let d_mm = (root as f64 * ROOT) * (root as f64 * ROOT);
                let shift_mm = (place as f64 - PLACES as f64) * PLACE_MM;
                let centre_mm = [self.centre_mm[0], self.centre_mm[1] + shift_mm];
                none.insert(Box::new(shares(stages, &self.tip, self.pitch_mm, centre_mm, d_mm)))
            }
        }
    }
}

/// The means as shares of the peak. Once for each knot: not to be in the way of what is done for each row.
#[cold]
fn shares(stages: &impl Stages, tip: &Tip, pitch_mm: f64, centre_mm: [f64; 2], d_mm: f64) -> [Row; ROWS] {
    if d_mm == 0.0 {
        return [[0.0; COLUMNS]; ROWS];
    }
    let peak_kpa = tip.modulus_kpa * d_mm / tip.radius_mm;
    let flattened = tip.flattened(d_mm);
    let shaped = stages.shaped();
    core::array::from_fn(|row| {
        core::array::from_fn(|column| {
            let cell = Cell::at(pitch_mm, centre_mm, row, column);
            let mean = if shaped { shape::mean_kpa(stages, tip, d_mm, &cell) } else { cell.mean_kpa(&flattened) };
            mean / peak_kpa
        })
    })
}

/// The lower knot and the weights of the four around a place.
fn weights(place: f64) -> (usize, [f64; 4]) {
    let knot = place as usize;
    let t = place - knot as f64;
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ];
    (knot, weights)
}
