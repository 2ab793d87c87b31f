//! One refinement: the weighted normal equations of all live taxels, and their solution.
//!
//! The unknowns are scaled so that every slope is at most about 1: the change of ln(s), and the centre's in units of s^2.
//! A taxel's weight falls from 1 where the model sees no pressure to 1/4 at the peak: a reading's error grows with the reading.

use super::arith::{high, quotient, within};
use super::geometry::{Geometry, PLACE_BITS};
use super::guess::{CENTRE_BITS, Felt, Guess, Pressed, SLOPE_BITS, square};
use super::rim::Rim;
use super::view::{PEAK_BITS, View};

/// A residual stops at half of the peak.
const RESIDUAL_MAX: i32 = 1 << (PEAK_BITS - 1);
/// Least weight of a taxel, Q13.
const WEIGHT_MIN: i32 = 1 << (SLOPE_BITS - 3);
/// Fractional bits of a solution before it is scaled.
const SOLUTION_BITS: u32 = 20;
/// The farthest that ln(s) moves in one step, Q28: 1/8.
const REST_STEP: i32 = 1 << 25;
/// The farthest that a centre moves along one axis, Q24: 1/4 of the radius.
const CENTRE_STEP: i32 = 1 << 22;
/// What is left of a diagonal element after elimination is at least this share of it: the guard of Levenberg.
const GUARD_BITS: u32 = 14;

/// How far the model and the picture are apart.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Misfit {
    /// Sum of the squared residuals, weighted, Q28 of the peak's square.
    pub squares: i64,
    /// Live taxels within the model's contact.
    pub taxels: u32,
}

/// Sums over a row: rest is `a`, square times weight is `k`, of which the place makes the centre's slope.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    rest_rest: i32,
    rest_square: i32,
    rest_x: i32,
    square_square: i32,
    square_x: i32,
    x_x: i32,
    rest: i32,
    square: i32,
    x: i32,
    squares: i32,
}

/// The normal equations; all in Q26 shifted right by 3, so that no diagonal reaches 2^31.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Equations {
    matrix: [i64; 6],
    right: [i64; 3],
    /// At the guess.
    pub misfit: Misfit,
}

/// What a taxel adds where the model is only compared, not refined.
pub(super) fn compare(pressed: &Pressed, view: &View) -> Misfit {
    let mut misfit = Misfit::default();
    each_row(pressed, view, |row, bad, dy| {
        let mut squares = 0;
        for ((column, taxel), dx) in row.iter().enumerate().zip(&pressed.dx) {
            if bad >> column & 1 != 0 {
                continue;
            }
            let at = square(*dx) + square(dy);
            let mut residual = view.share(*taxel);
            if at < pressed.outside {
                let felt = pressed.felt(at);
                misfit.taxels += 1;
                residual = within(residual - felt.pressure, RESIDUAL_MAX);
                squares += ((weight(&felt) * residual) >> SLOPE_BITS) * residual;
            } else {
                residual = within(residual, RESIDUAL_MAX);
                squares += residual * residual;
            }
        }
        misfit.squares += i64::from(squares);
    });
    misfit
}

/// Sets up the normal equations; with a rim, the taxels under it are worked out by it.
pub(super) fn equations(pressed: &Pressed, view: &View, rim: Option<&Rim>) -> Equations {
    let mut all = Equations::default();
    each_row(pressed, view, |row, bad, dy| {
        let mut sums = Row::default();
        for ((column, taxel), dx) in row.iter().enumerate().zip(&pressed.dx) {
            if bad >> column & 1 != 0 {
                continue;
            }
            let at = square(*dx) + square(dy);
            let share = view.share(*taxel);
            if at >= pressed.outside {
                let residual = within(share, RESIDUAL_MAX);
                sums.squares += residual * residual;
                continue;
            }
            let mut felt = pressed.felt(at);
            if let (Some(rim), true) = (rim, at >= pressed.inside) {
                felt.pressure = rim.pressure(*dx, dy, view);
            }
            all.misfit.taxels += 1;
            sums.add(&felt, *dx, within(share - felt.pressure, RESIDUAL_MAX));
        }
        all.add(&sums, dy);
    });
    for element in all.matrix.iter_mut().chain(&mut all.right) {
        *element >>= 3;
    }
    all
}

/// Hands each row's taxels, bad bits and place to `f`.
#[inline(always)]
fn each_row(pressed: &Pressed, view: &View, mut f: impl FnMut(&[i32; 10], u16, i32)) {
    for ((row, bad), dy) in view.picture.taxels.iter().zip(&view.picture.bad).zip(&pressed.dy) {
        f(row, *bad, *dy);
    }
}

/// 1 less 3/4 of the model's pressure over the peak, Q13.
#[inline(always)]
fn weight(felt: &Felt) -> i32 {
    ((1 << SLOPE_BITS) - (3 * felt.pressure >> 3)).max(WEIGHT_MIN)
}

impl Row {
    #[inline(always)]
    fn add(&mut self, felt: &Felt, dx: i32, residual: i32) {
        let weight = weight(felt);
        let rest = (weight * felt.by_rest) >> SLOPE_BITS;
        let square = (weight * felt.by_square) >> SLOPE_BITS;
        let weighted_x = (square * dx) >> PLACE_BITS;
        let x = (felt.by_square * dx) >> PLACE_BITS;
        self.rest_rest += rest * felt.by_rest;
        self.rest_square += rest * felt.by_square;
        self.rest_x += rest * x;
        self.square_square += square * felt.by_square;
        self.square_x += square * x;
        self.x_x += weighted_x * x;
        self.rest += rest * residual;
        self.square += square * residual;
        self.x += weighted_x * residual;
        self.squares += ((weight * residual) >> SLOPE_BITS) * residual;
    }
}

impl Equations {
    fn add(&mut self, row: &Row, dy: i32) {
        let times_dy = |sum: i32| (i64::from(sum) * i64::from(dy)) >> PLACE_BITS;
        let [ss, sx, sy, xx, xy, yy] = &mut self.matrix;
        *ss += i64::from(row.rest_rest);
        *sx -= i64::from(row.rest_x);
        *sy -= times_dy(row.rest_square);
        *xx += i64::from(row.x_x);
        *xy += times_dy(row.square_x);
        *yy += (times_dy(row.square_square) * i64::from(dy)) >> PLACE_BITS;
        let [s, x, y] = &mut self.right;
        *s -= i64::from(row.rest);
        *x += i64::from(row.x);
        *y += times_dy(row.square);
        self.misfit.squares += i64::from(row.squares);
    }

    /// The next guess, and the misfit that the linearised model promises there.
    pub fn solve(&self, guess: &Guess, view: &View, geometry: &Geometry) -> (Guess, Misfit) {
        let [ss, sx, sy, xx, xy, yy] = self.matrix;
        let [s, x, y] = self.right;
        let pivot = |left: i64, of: i64| left.max(of >> GUARD_BITS).max(1);
        let times = |share: i32, of: i64| (i64::from(share) * of) >> 28;

        let ss = pivot(ss, ss);
        let (share_x, share_y) = (quotient(sx, ss.unsigned_abs(), 28), quotient(sy, ss.unsigned_abs(), 28));
        let left_xx = pivot(xx - times(share_x, sx), xx);
        let left_xy = xy - times(share_x, sy);
        let (left_x, left_y) = (x - times(share_x, s), y - times(share_y, s));
        let share = quotient(left_xy, left_xx.unsigned_abs(), 28);
        let left_yy = pivot(yy - times(share_y, sy) - times(share, left_xy), yy);
        let y_step = quotient(left_y - times(share, left_x), left_yy.unsigned_abs(), SOLUTION_BITS);
        let times = |step: i32, of: i64| (i64::from(step) * of) >> SOLUTION_BITS;
        let x_step = quotient(left_x - times(y_step, left_xy), left_xx.unsigned_abs(), SOLUTION_BITS);
        let rest_step = quotient(s - times(x_step, sx) - times(y_step, sy), ss.unsigned_abs(), SOLUTION_BITS);

        // Slopes count Y and residuals the peak, so the solution is divided by Y over the peak.
        let drop = 62 - view.modulus_shift - SLOPE_BITS - (28 - SOLUTION_BITS);
        let scaled = |step: i32, limit: i32| {
            let wide = (i64::from(step) * i64::from(view.inverse_modulus)) >> drop;
            within(wide.max(i64::from(-limit)).min(i64::from(limit)) as i32, limit)
        };
        let rest = guess.rest + (high(guess.rest, scaled(rest_step, REST_STEP)) << 4);
        let rest_square = high(guess.rest, guess.rest) << 4;
        let moved = |centre: i32, step: i32| {
            let step = (i64::from(rest_square) * i64::from(scaled(step, i32::MAX))) >> (56 - CENTRE_BITS);
            centre + within(step.max(i64::from(-CENTRE_STEP)).min(i64::from(CENTRE_STEP)) as i32, CENTRE_STEP)
        };
        let next = Guess::new(rest, moved(guess.x, x_step), moved(guess.y, y_step), geometry);
        let promised = (times(rest_step, s) + times(x_step, x) + times(y_step, y)) << 3;
        let squares = (self.misfit.squares - promised).max(0);
        (next, Misfit { squares, ..self.misfit })
    }
}
