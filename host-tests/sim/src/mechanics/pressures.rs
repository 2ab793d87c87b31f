//! What each taxel feels of a contact, quick: its mean pressure depends only on the indentation and on where the
//! contact's centre is.
//!
//! Means are worked out at the knots of a grid, once each and only where a contact comes by, and interpolated between
//! them. The grid runs in the square root of the indentation, in which the rim moves evenly, and holds the means as
//! shares of the peak Y d / a, which vary slowly. Cubic lines through four knots, with equal slopes where they meet
//! (Catmull and Rom).

use super::shape;
use crate::effects::contact::Stages;
use crate::mechanics::cells::Cell;
use crate::setup::Tip;
use fingertip::shipped::{COLUMNS, ROWS};

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
    peak_per_mm: f64,
    /// For each place of the centre by the root, beginning with the knot before the first: the shares are even in the
    /// root.
    knots: Vec<Vec<Knot>>,
}

/// All taxels' means as shares of the peak, once they are worked out.
type Knot = Option<Box<[Row; ROWS]>>;

/// Where between the knots a contact is: what its rows have in common.
#[derive(Clone, Copy, Debug)]
pub struct Between {
    root: usize,
    weights: [f64; 4],
    peak_kpa: f64,
    shift_mm: f64,
}

impl Between {
    /// No contact.
    pub const NOTHING: Self = Self { root: 0, weights: [0.0; 4], peak_kpa: 0.0, shift_mm: 0.0 };
}

/// The four knots around a root.
struct Around {
    place: usize,
    root: usize,
}

impl Pressures {
    /// Of a tip over an array whose middle is so far from the contact's centre.
    pub fn new(tip: Tip, pitch_mm: f64, centre_mm: [f64; 2]) -> Self {
        let deepest_mm = Tip::DEEPEST * tip.radius_mm;
        let roots = (deepest_mm.sqrt() / ROOT) as usize + 4;
        let knots = (0..=2 * PLACES).map(|_| vec![None; roots]).collect();
        let peak_per_mm = tip.modulus_kpa / tip.radius_mm;
        Self { tip, pitch_mm, centre_mm, deepest_mm, peak_per_mm, knots }
    }

    /// Where an indentation is, with the centre shifted along the rows.
    #[inline]
    pub fn between(&self, d_mm: f64, shift_mm: f64) -> Between {
        if d_mm <= 0.0 {
            return Between::NOTHING;
        }
        let d_mm = d_mm.min(self.deepest_mm);
        let (root, weights) = weigh(d_mm.sqrt() / ROOT);
        Between { root, weights, peak_kpa: self.peak_per_mm * d_mm, shift_mm }
    }

    /// Means of one row.
    #[inline]
    pub fn row_kpa(&mut self, stages: &impl Stages, between: &Between, row: usize) -> Row {
        let mut kpa = [0.0; COLUMNS];
        if between.peak_kpa > 0.0 {
            while let Err(missing) = self.sum(between, row, &mut kpa) {
                self.work_out(stages, missing);
            }
        }
        kpa
    }

    /// Sets the means, or says which knots are not worked out yet.
    fn sum(&self, between: &Between, row: usize, kpa: &mut Row) -> Result<(), Around> {
        let Between { root, weights, peak_kpa, shift_mm } = *between;
        if shift_mm == 0.0 {
            // At a knot, as where nothing moves along the surface, it alone counts.
            let [a, b, c, d] = self.around(PLACES, root, row)?;
            let [wa, wb, wc, wd] = weights.map(|weight| weight * peak_kpa);
            *kpa = core::array::from_fn(|n| positive(wa * a[n] + wb * b[n] + wc * c[n] + wd * d[n]));
            return Ok(());
        }
        let (place, along) = weigh((shift_mm / PLACE_MM + PLACES as f64).clamp(1.0, 2.0 * PLACES as f64 - 2.0));
        let mut sum = [0.0; COLUMNS];
        for (next, along) in along.into_iter().enumerate() {
            let [a, b, c, d] = self.around(place + next - 1, root, row)?;
            let [wa, wb, wc, wd] = weights.map(|weight| along * weight * peak_kpa);
            for (n, sum) in sum.iter_mut().enumerate() {
                *sum += wa * a[n] + wb * b[n] + wc * c[n] + wd * d[n];
            }
        }
        *kpa = sum.map(positive);
        Ok(())
    }

    /// A row at the four knots around a root.
    #[inline(always)]
    fn around(&self, place: usize, root: usize, row: usize) -> Result<[&Row; 4], Around> {
        match &self.knots[place][root..root + 4] {
            [Some(a), Some(b), Some(c), Some(d)] => Ok([&a[row], &b[row], &c[row], &d[row]]),
            _ => Err(Around { place, root }),
        }
    }

    /// Where a contact comes by for the first time: not to be in the way of what is done for each row.
    #[cold]
    fn work_out(&mut self, stages: &impl Stages, around: Around) {
        let shift_mm = (around.place as f64 - PLACES as f64) * PLACE_MM;
        let centre_mm = [self.centre_mm[0], self.centre_mm[1] + shift_mm];
        for (at, knot) in self.knots[around.place].iter_mut().enumerate().skip(around.root).take(4) {
            let root = (at as f64 - 1.0) * ROOT;
            knot.get_or_insert_with(|| Box::new(shares(stages, &self.tip, self.pitch_mm, centre_mm, root * root)));
        }
    }
}

/// The means as shares of the peak.
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

/// What is above 0, and 0 else: the lines overshoot where a taxel begins to feel the rim.
fn positive(kpa: f64) -> f64 {
    if kpa > 0.0 { kpa } else { 0.0 }
}

/// The lower knot and the weights of the four around a place.
fn weigh(place: f64) -> (usize, [f64; 4]) {
    let knot = place as i32;
    let t = place - f64::from(knot);
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ];
    (knot as usize, weights)
}
