//! What a taxel feels: the pressure averaged over its square.
//!
//! A square inside the contact is a smooth function's, so 3 x 3 Gauss points do. The rim bends the pressure, so a
//! square that it crosses is cut into strips along y at every place where the rim meets a side or turns, each strip
//! into chords that end on the rim. Along a chord the pressure is smooth; across, it ends like (r_c - y)^1.5, which
//! takes 5 points.

use super::tip::Flattened;
use crate::setup::Setup;
use fingertip::shipped::{COLUMNS, ROWS};

/// Gauss-Legendre nodes and weights on -1..1, 3 points: 0 and sqrt(3/5); 5/9, 8/9, 5/9.
const GAUSS3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_888_8),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];

/// The same with 5 points.
const GAUSS5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// A rectangle from the contact's centre, mm.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Left and right side.
    pub x_mm: [f64; 2],
    /// Lower and upper side.
    pub y_mm: [f64; 2],
}

impl Cell {
    /// The square of a taxel.
    pub fn of(setup: &Setup, row: usize, column: usize) -> Self {
        Self::at(setup.array.pitch_mm, [setup.wall.centre_x_mm, setup.wall.centre_y_mm], row, column)
    }

    /// The same, of squares so far apart under a contact centred there.
    pub fn at(pitch_mm: f64, centre_mm: [f64; 2], row: usize, column: usize) -> Self {
        let left = (column as f64 - 0.5 * COLUMNS as f64) * pitch_mm - centre_mm[0];
        let low = (row as f64 - 0.5 * ROWS as f64) * pitch_mm - centre_mm[1];
        Self { x_mm: [left, left + pitch_mm], y_mm: [low, low + pitch_mm] }
    }

    /// Mean pressure on it.
    pub fn mean_kpa(&self, tip: &Flattened) -> f64 {
        let rim2 = tip.contact_radius2_mm2();
        let near2 = square(nearest(self.x_mm)) + square(nearest(self.y_mm));
        if near2 >= rim2 {
            return 0.0;
        }
        let far2 = square(farthest(self.x_mm)) + square(farthest(self.y_mm));
        let integral = if far2 <= rim2 {
            gauss(&GAUSS3, self.y_mm, |y| gauss(&GAUSS3, self.x_mm, |x| tip.pressure_kpa(x * x + y * y)))
        } else {
            self.cut_by_rim(tip, rim2)
        };
        integral / ((self.x_mm[1] - self.x_mm[0]) * (self.y_mm[1] - self.y_mm[0]))
    }

    fn cut_by_rim(&self, tip: &Flattened, rim2: f64) -> f64 {
        let rim = rim2.sqrt();
        let chord = |y: f64| {
            let half = (rim2 - y * y).max(0.0).sqrt();
            let ends = [self.x_mm[0].max(-half), self.x_mm[1].min(half)];
            if ends[0] < ends[1] { gauss(&GAUSS3, ends, |x| tip.pressure_kpa(x * x + y * y)) } else { 0.0 }
        };
        let meets = self.x_mm.map(|x| (rim2 - x * x).max(0.0).sqrt());
        let (low, high) = (meets[0].min(meets[1]), meets[0].max(meets[1]));
        let mut cuts = [self.y_mm[0], -rim, -high, -low, low, high, rim, self.y_mm[1]];
        for cut in &mut cuts {
            *cut = cut.clamp(self.y_mm[0], self.y_mm[1]);
        }
        cuts.windows(2)
            .map(|strip| if strip[0] < strip[1] { gauss(&GAUSS5, [strip[0], strip[1]], chord) } else { 0.0 })
            .sum()
    }
}

/// Integral over an interval.
fn gauss(rule: &[(f64, f64)], over: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (over[0] + over[1]), 0.5 * (over[1] - over[0]));
    half * rule.iter().map(|(node, weight)| weight * f(middle + half * node)).sum::<f64>()
}

/// The place of an interval that is nearest to 0.
fn nearest(over: [f64; 2]) -> f64 {
    over[0].max(0.0) + over[1].min(0.0)
}

/// The end of an interval that is farthest from 0, without its sign.
fn farthest(over: [f64; 2]) -> f64 {
    over[1].max(-over[0])
}

fn square(x: f64) -> f64 {
    x * x
}
