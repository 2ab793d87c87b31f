//! Mean pressures on the taxels, fast: they depend only on the indentation and on the centre of the contact.
//!
//! The means are computed at the knots of a grid, once each and only where a contact needs them, and interpolated
//! between them. The grid runs in the square root of the indentation, in which the rim moves evenly, and holds the
//! means as shares of the peak Y d / a, which vary slowly. Cubic lines through four knots have equal slopes where they
//! meet (Catmull and Rom).
//!
//! The mean over the square of a taxel: inside the contact the pressure is smooth, so 3 x 3 Gauss points are enough.
//! The rim bends the pressure. A square that the rim crosses is cut into strips along y at every place where the rim
//! meets a side or turns, and each strip into chords that end on the rim. Along a chord the pressure is smooth; across,
//! it ends like (r_c - y)^1.5, which takes 5 points.
//!
//! The tip on a rigid plane is that of Park, Kim and Hirai, "Development of a Soft-fingertip and Its Modeling Based on
//! Force Distribution", ICRA 2003.

use crate::effects::contact::Named;
use crate::setup::{Setup, Tip};
use core::f64::consts::PI;
use fingertip::shipped::{COLUMNS, ROWS};

type Row = [f64; COLUMNS];
/// Distance of knots in the square root of the indentation, sqrt(mm): the rim moves 0.07 mm per knot.
const ROOT: f64 = 1.0 / 64.0;
/// Distance of knots in the place of the centre, mm.
const PLACE_MM: f64 = 0.125;
/// Knots on either side of the place of the centre at rest.
const PLACES: usize = 64;

/// Mean pressures on the taxels of one finger.
pub struct Pressures {
    tip: Tip,
    pitch_mm: f64,
    centre_mm: [f64; 2],
    /// Knots by place of the centre and root of the indentation. The first root mirrors the one after 0.
    knots: Vec<Vec<Knot>>,
    /// Points of a shaped surface by place of the centre, from the first contact there on.
    points: Vec<Option<Points>>,
}

/// Mean pressures on all taxels as shares of the peak, once they are computed.
type Knot = Option<Box<[Row; ROWS]>>;

/// Place of a contact between the knots: what its rows have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    root: usize,
    weights: [f64; 4],
    peak_kpa: f64,
    shift_mm: f64,
}

impl Between {
    pub const NOTHING: Self = Self { root: 0, weights: [0.0; 4], peak_kpa: 0.0, shift_mm: 0.0 };
}

impl Pressures {
    /// Pressures of a tip on an array whose middle has this distance from the centre of the contact.
    pub fn new(tip: Tip, pitch_mm: f64, centre_mm: [f64; 2]) -> Self {
        let roots = ((Tip::DEEPEST * tip.radius_mm).sqrt() / ROOT) as usize + 4;
        let knots = (0..=2 * PLACES).map(|_| vec![None; roots]).collect();
        let points = (0..=2 * PLACES).map(|_| None).collect();
        Self { tip, pitch_mm, centre_mm, knots, points }
    }

    /// Returns the place of an indentation, with the centre shifted along the rows.
    pub fn between(&self, d_mm: f64, shift_mm: f64) -> Between {
        if d_mm <= 0.0 {
            return Between::NOTHING;
        }
        let Tip { radius_mm, modulus_kpa } = self.tip;
        let d_mm = d_mm.min(Tip::DEEPEST * radius_mm);
        let (root, weights) = weigh(d_mm.sqrt() / ROOT);
        Between { root, weights, peak_kpa: modulus_kpa / radius_mm * d_mm, shift_mm }
    }

    pub fn row_kpa(&mut self, effects: &Named, between: &Between, row: usize) -> Row {
        let Between { root, weights, peak_kpa, shift_mm } = *between;
        let mut sum = [0.0; COLUMNS];
        if peak_kpa > 0.0 {
            let (place, along) = weigh((shift_mm / PLACE_MM + PLACES as f64).clamp(1.0, 2.0 * PLACES as f64 - 2.0));
            // Without a shift along the surface the place is a knot.
            for (place, along) in (place - 1..).zip(along).filter(|(_, along)| *along != 0.0) {
                let [a, b, c, d] = self.around(effects, place, root, row);
                let [wa, wb, wc, wd] = weights.map(|weight| along * weight * peak_kpa);
                for (n, sum) in sum.iter_mut().enumerate() {
                    *sum += wa * a[n] + wb * b[n] + wc * c[n] + wd * d[n];
                }
            }
        }
        // The interpolation overshoots where a taxel first touches the rim.
        sum.map(|kpa| if kpa > 0.0 { kpa } else { 0.0 })
    }

    /// Returns a row at the four knots around a root.
    #[inline(always)]
    fn around(&mut self, effects: &Named, place: usize, root: usize, row: usize) -> [&Row; 4] {
        if self.knots[place][root..root + 4].iter().any(Option::is_none) {
            self.work_out(effects, place, root);
        }
        let knots = &self.knots[place][root..root + 4];
        core::array::from_fn(|at| knots[at].as_ref().map_or(&[0.0; COLUMNS], |knot| &knot[row]))
    }

    /// Computes the knots around a root at the first contact there. Cold, so that the work for each row stays fast.
    #[cold]
    fn work_out(&mut self, effects: &Named, place: usize, root: usize) {
        let shift_mm = (place as f64 - PLACES as f64) * PLACE_MM;
        let centre_mm = [self.centre_mm[0], self.centre_mm[1] + shift_mm];
        let (tip, pitch_mm, points) = (&self.tip, self.pitch_mm, &mut self.points[place]);
        let cells = move || {
            let taxels = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)));
            taxels.map(move |(row, column)| Cell::at(pitch_mm, centre_mm, row, column))
        };
        for (at, knot) in self.knots[place].iter_mut().enumerate().skip(root).take(4) {
            let root = (at as f64 - 1.0) * ROOT;
            let d_mm = root * root;
            knot.get_or_insert_with(|| {
                if d_mm == 0.0 {
                    Box::new([[0.0; COLUMNS]; ROWS])
                } else if effects.shaped() {
                    let points = points.get_or_insert_with(|| Points::of(effects, tip, cells()));
                    by_row(points.means(d_mm).map(|share| share * tip.radius_mm / d_mm))
                } else {
                    let (flattened, peak_kpa) = (tip.flattened(d_mm), tip.modulus_kpa * d_mm / tip.radius_mm);
                    by_row(cells().map(|cell| cell.mean_kpa(&flattened) / peak_kpa))
                }
            });
        }
    }
}

/// Numbers of the taxels, row by row.
fn by_row(mut numbers: impl Iterator<Item = f64>) -> Box<[Row; ROWS]> {
    Box::new(core::array::from_fn(|_| core::array::from_fn(|_| numbers.next().unwrap_or(0.0))))
}

/// Lower knot of a place, and the weights of the four knots around it.
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

/// Samples along the side of a taxel.
const ALONG: usize = 16;

/// Places on the taxels, by the midpoints of their squares: the indentation at which the tip touches there, mm, and 1/L.
pub struct Points {
    clearance_mm: Vec<f64>,
    per_length: Vec<f64>,
}

impl Points {
    /// Points of the taxels of these squares.
    pub fn of(effects: &Named, tip: &Tip, cells: impl Iterator<Item = Cell>) -> Self {
        let at = |side: [f64; 2], n: usize| side[0] + (side[1] - side[0]) * (n as f64 + 0.5) / ALONG as f64;
        let (mut clearance_mm, mut per_length) = (Vec::new(), Vec::new());
        for cell in cells {
            for (i, j) in (0..ALONG).flat_map(|i| (0..ALONG).map(move |j| (i, j))) {
                let (x_mm, y_mm) = (at(cell.x_mm, i), at(cell.y_mm, j));
                let length_mm = (tip.radius_mm * tip.radius_mm - x_mm * x_mm - y_mm * y_mm).max(0.0).sqrt();
                let reached_mm = length_mm + effects.height_mm(x_mm, y_mm, tip.radius_mm);
                clearance_mm.push(tip.radius_mm - reached_mm);
                // At the rim of the tip nothing is left to compress.
                per_length.push(if length_mm > 0.0 { 1.0 / length_mm } else { 0.0 });
            }
        }
        Self { clearance_mm, per_length }
    }

    /// Mean pressure on each taxel at an indentation, as shares of Y, in the order of the squares.
    pub fn means(&self, d_mm: f64) -> impl Iterator<Item = f64> {
        /// Sums side by side, which the processor adds at once.
        const LANES: usize = 8;
        let taxels = self.clearance_mm.chunks_exact(ALONG * ALONG).zip(self.per_length.chunks_exact(ALONG * ALONG));
        taxels.map(move |(clearance_mm, per_length)| {
            let mut sums = [0.0; LANES];
            for (clearances, lengths) in clearance_mm.chunks_exact(LANES).zip(per_length.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    let compressed = (d_mm - clearances[lane]).max(0.0) * lengths[lane];
                    sums[lane] += compressed.min(Tip::DEEPEST);
                }
            }
            sums.iter().sum::<f64>() / (ALONG * ALONG) as f64
        })
    }
}

/// Gauss-Legendre nodes and weights on -1..1, 3 points: 0 and sqrt(3/5); 5/9, 8/9, 5/9.
const GAUSS3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
    (0.0, 0.888_888_888_888_888_8),
    (0.774_596_669_241_483_4, 0.555_555_555_555_555_6),
];

/// Gauss-Legendre nodes and weights on -1..1, 5 points.
const GAUSS5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];

/// Rectangle, from the centre of the contact, mm.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Left and right side.
    pub x_mm: [f64; 2],
    /// Lower and upper side.
    pub y_mm: [f64; 2],
}

impl Cell {
    /// Square of a taxel.
    pub fn of(setup: &Setup, row: usize, column: usize) -> Self {
        Self::at(setup.array.pitch_mm, [setup.wall.centre_x_mm, setup.wall.centre_y_mm], row, column)
    }

    /// Square of a taxel of an array with this pitch, under a contact with this centre.
    pub fn at(pitch_mm: f64, centre_mm: [f64; 2], row: usize, column: usize) -> Self {
        let left = (column as f64 - 0.5 * COLUMNS as f64) * pitch_mm - centre_mm[0];
        let low = (row as f64 - 0.5 * ROWS as f64) * pitch_mm - centre_mm[1];
        Self { x_mm: [left, left + pitch_mm], y_mm: [low, low + pitch_mm] }
    }

    pub fn mean_kpa(&self, tip: &Flattened) -> f64 {
        let rim2 = tip.contact_radius2_mm2;
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

fn gauss(rule: &[(f64, f64)], over: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (over[0] + over[1]), 0.5 * (over[1] - over[0]));
    half * rule.iter().map(|(node, weight)| weight * f(middle + half * node)).sum::<f64>()
}

/// Value of an interval that is nearest to 0.
fn nearest(over: [f64; 2]) -> f64 {
    over[0].max(0.0) + over[1].min(0.0)
}

/// Largest distance from 0 within an interval.
fn farthest(over: [f64; 2]) -> f64 {
    over[1].max(-over[0])
}

fn square(x: f64) -> f64 {
    x * x
}

/// Tip flattened by an indentation d: the terms that do not depend on the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flattened {
    modulus_kpa: f64,
    radius2_mm2: f64,
    remaining_mm: f64,
    /// Square of the contact radius (eq. 5, 6).
    pub contact_radius2_mm2: f64,
}

impl Tip {
    /// Deepest indentation with defined pressures, as a share of the radius: beyond it lies the bone.
    pub const DEEPEST: f64 = 0.999;

    /// pi Y, so that F = pi Y d^2 (eq. 14), N/mm^2.
    pub fn force_per_mm2(&self) -> f64 {
        PI * self.modulus_kpa * 1e-3
    }

    /// Total normal force of an indentation (eq. 14); 0 without contact.
    pub fn force_n(&self, indentation_mm: f64) -> f64 {
        let d = indentation_mm.max(0.0);
        self.force_per_mm2() * d * d
    }

    /// Indentation of a force, the inverse of [`Tip::force_n`].
    pub fn indentation_mm(&self, force_n: f64) -> f64 {
        (force_n.max(0.0) / self.force_per_mm2()).sqrt()
    }

    pub fn flattened(&self, indentation_mm: f64) -> Flattened {
        let a = self.radius_mm;
        let d = indentation_mm.clamp(0.0, Self::DEEPEST * a);
        Flattened {
            modulus_kpa: self.modulus_kpa,
            radius2_mm2: a * a,
            remaining_mm: a - d,
            contact_radius2_mm2: d * (2.0 * a - d),
        }
    }
}

impl Flattened {
    /// Pressure at a distance from the contact's centre (eq. 13, 15, 16); 0 outside of the contact.
    ///
    /// p = Y dL/L with L = sqrt(a^2 - r^2) and dL = (r_c^2 - r^2) / (L + a - d), which equals L - (a - d) but
    /// cancels nothing at the rim.
    pub fn pressure_kpa(&self, distance2_mm2: f64) -> f64 {
        let inside = self.contact_radius2_mm2 - distance2_mm2;
        if inside <= 0.0 {
            return 0.0;
        }
        let length = (self.radius2_mm2 - distance2_mm2).sqrt();
        self.modulus_kpa * inside / ((length + self.remaining_mm) * length)
    }
}
