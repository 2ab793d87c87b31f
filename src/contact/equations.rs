//! One refinement: the weighted normal equations of all live taxels, and their solution.
//!
//! The unknowns are scaled so that every slope is at most about 1: the change of ln(s), and the centre's in units of
//! s^2. A reading's error grows with the reading, so a taxel's weight falls with the model's pressure, from 1 to 1/4 at
//! the peak.

use super::prediction::{
    CENTRE_BITS, Guess, PEAK_BITS, PeakScale, Prediction, SLOPE_BITS, ScaledImage, TaxelModel, square,
};
use crate::arith::{Divisor, clamp_to, high};
use crate::config::array::{Geometry, PLACE_BITS};

/// Limit of a residual: half of the peak.
const RESIDUAL_LIMIT: i32 = 1 << (PEAK_BITS - 1);
/// Fractional bits of shares and of the solution before it is scaled.
const SHARE_BITS: u32 = 24;
/// Largest change of ln(s) in one step, Q28: 1/8.
const HEIGHT_STEP: i32 = 1 << 25;
/// Largest change of a centre along one axis in one step, Q24: 1/4 of the radius.
const CENTRE_STEP: i32 = 1 << 21;
/// Least remainder of a diagonal element after elimination, as a share of it: the guard of Levenberg.
const GUARD_BITS: u32 = 14;

/// Difference of the model and the image. Squares are in units of 2^-28 of the peak's square, less `Bits::ALL` bits:
/// 2^-24 with ten rows and columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Misfit {
    /// Sum of the squared residuals of live taxels within the model's contact.
    pub inside: i32,
    /// Number of these taxels.
    pub taxels: i32,
    /// Sum of the squares of the other live taxels.
    pub outside: i32,
    /// Number of these taxels.
    pub others: i32,
}

impl Misfit {
    /// Misfit of no taxels.
    pub const NONE: Self = Self { inside: 0, taxels: 0, outside: 0, others: 0 };
}

/// Sums over a row of weighted products: `height` is the slope by ln(s), `square` that by the squared distance, `x` the
/// latter times the place along the columns, and a name alone its product with the residual.
#[derive(Clone, Copy, Debug, Default)]
struct Row<const ROWS: usize, const COLUMNS: usize> {
    height_height: i32,
    height_square: i32,
    height_x: i32,
    square_square: i32,
    square_x: i32,
    x_x: i32,
    height: i32,
    square: i32,
    x: i32,
    misfit: Misfit,
}

/// Bits dropped from sums over the taxels, so that they fit 32 bits.
///
/// A slope is at most 1.5: inside it is at most 1.31 where the indentation is the guess's, and half more where it
/// follows the force away from it; under the rim it stops there. So the squares of a row's slopes average 9/4 at most,
/// in Q26. What all rows add up to has another bit to spare. A row loses four bits at least, so that its shifted place,
/// up to two radii, fits too.
pub struct Bits<const ROWS: usize, const COLUMNS: usize>;

impl<const ROWS: usize, const COLUMNS: usize> Bits<ROWS, COLUMNS> {
    /// Bits dropped from a taxel's part of its row: none up to 14 columns, 2 with 32.
    const TAXEL: u32 = {
        let mut drop = 0;
        while (COLUMNS as u64 * 9) << 24 >> drop >= 1 << 31 {
            drop += 1;
        }
        drop
    };
    /// Bits dropped from a row's sums: 4 with 10 x 10, 5 with 16 x 16 and 16 x 32.
    const ROW: u32 = {
        let mut drop = 4;
        while ((ROWS * COLUMNS) as u64 * 9) << 25 >> (Self::TAXEL + drop) >= 1 << 31 {
            drop += 1;
        }
        drop
    };
    /// Bits dropped in both steps.
    pub const ALL: u32 = Self::TAXEL + Self::ROW;
}

/// Normal equations, Q26 less `Bits::ALL`: Q22 with ten rows and columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Equations<const ROWS: usize, const COLUMNS: usize> {
    matrix: [i32; 6],
    right: [i32; 3],
    /// Misfit at the guess.
    pub misfit: Misfit,
}

/// Inputs of a comparison of a row.
#[derive(Clone, Copy)]
pub struct Comparison<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Prediction of each taxel from the guess.
    pub prediction: &'a Prediction<ROWS, COLUMNS>,
    /// Tactile image.
    pub view: &'a ScaledImage<'a, ROWS, COLUMNS>,
    /// Geometry of the taxels.
    pub geometry: &'a Geometry,
}

impl Misfit {
    /// Adds a row's difference to the model, if the model is not to be refined.
    #[inline(never)]
    pub fn compare_row<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        Comparison { prediction, view, geometry }: Comparison<ROWS, COLUMNS>,
        row: usize,
    ) {
        let (Some(taxels), Some(bad), Some(dy)) =
            (view.picture.taxels.get(row), view.picture.bad.get(row), prediction.dy.get(row))
        else {
            return;
        };
        let dy_square = square(*dy);
        let mut bad = *bad;
        let mut row = Self::NONE;
        for (taxel, dx_square) in taxels.iter().zip(&prediction.dx_square) {
            if bad & 1 == 0 {
                let at = dx_square + dy_square;
                let share = view.share(*taxel);
                if at < prediction.outside {
                    row.taxels += 1;
                    let residual = residual(share - prediction.taxel(at, &geometry.nodes).pressure);
                    row.inside += (residual * residual) >> Bits::<ROWS, COLUMNS>::TAXEL;
                } else {
                    row.others += 1;
                    row.outside += (residual(share) * residual(share)) >> Bits::<ROWS, COLUMNS>::TAXEL;
                }
            }
            bad >>= 1;
        }
        self.add_row::<ROWS, COLUMNS>(&row);
    }

    fn add_row<const ROWS: usize, const COLUMNS: usize>(&mut self, row: &Self) {
        self.taxels += row.taxels;
        self.others += row.others;
        self.inside += row.inside >> Bits::<ROWS, COLUMNS>::ROW;
        self.outside += row.outside >> Bits::<ROWS, COLUMNS>::ROW;
    }
}

/// Limits a residual to half of the peak.
#[inline(always)]
fn residual(of: i32) -> i32 {
    of.max(-RESIDUAL_LIMIT).min(RESIDUAL_LIMIT - 1)
}

/// Returns the weight, Q13: 1 less 3/4 of the model's pressure over the peak.
#[inline(always)]
fn weight(pressure: i32) -> i32 {
    (1 << SLOPE_BITS) - ((3 * pressure.min(1 << PEAK_BITS)) >> 3)
}

impl<const ROWS: usize, const COLUMNS: usize> Row<ROWS, COLUMNS> {
    #[inline(always)]
    fn add(&mut self, model: &TaxelModel, dx: i32, residual: i32, weight: i32) {
        let height = (weight * model.by_height) >> SLOPE_BITS;
        let square = (weight * model.by_square) >> SLOPE_BITS;
        let weighted_x = (square * dx) >> PLACE_BITS;
        let x = (model.by_square * dx) >> PLACE_BITS;
        let add = |sum: &mut i32, product: i32| *sum += product >> Bits::<ROWS, COLUMNS>::TAXEL;
        add(&mut self.height_height, height * model.by_height);
        add(&mut self.height_square, height * model.by_square);
        add(&mut self.height_x, height * x);
        add(&mut self.square_square, square * model.by_square);
        add(&mut self.square_x, square * x);
        add(&mut self.x_x, weighted_x * x);
        add(&mut self.height, height * residual);
        add(&mut self.square, square * residual);
        add(&mut self.x, weighted_x * residual);
        add(&mut self.misfit.inside, residual * residual);
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Equations<ROWS, COLUMNS> {
    /// Equations of no taxels.
    pub const NONE: Self = Self { matrix: [0; 6], right: [0; 3], misfit: Misfit::NONE };

    /// Adds a row.
    #[inline(never)]
    pub fn take_row(&mut self, comparison: Comparison<ROWS, COLUMNS>, row: usize) {
        self.take_row_by(comparison, row, |model, _| weight(model.pressure));
    }

    /// Adds a row; `weigh` returns a taxel's weight, Q13, and may change its pressure: its arguments are the squared
    /// distance, Q28, and the place, Q15.
    #[inline(always)]
    pub fn take_row_by(
        &mut self,
        Comparison { prediction, view, geometry }: Comparison<ROWS, COLUMNS>,
        row: usize,
        weigh: impl Fn(&mut TaxelModel, (u32, [i32; 2])) -> i32,
    ) {
        let (Some(taxels), Some(bad), Some(dy)) =
            (view.picture.taxels.get(row), view.picture.bad.get(row), prediction.dy.get(row))
        else {
            return;
        };
        let dy_square = square(*dy);
        let mut bad = *bad;
        let mut sums = Row::<ROWS, COLUMNS>::default();
        for ((taxel, dx), dx_square) in taxels.iter().zip(&prediction.dx).zip(&prediction.dx_square) {
            if bad & 1 == 0 {
                let at = dx_square + dy_square;
                let share = view.share(*taxel);
                if at < prediction.outside {
                    let mut model = prediction.taxel(at, &geometry.nodes);
                    let weight = weigh(&mut model, (at, [*dx, *dy]));
                    sums.misfit.taxels += 1;
                    sums.add(&model, *dx, residual(share - model.pressure), weight);
                } else {
                    sums.misfit.others += 1;
                    sums.misfit.outside += (residual(share) * residual(share)) >> Bits::<ROWS, COLUMNS>::TAXEL;
                }
            }
            bad >>= 1;
        }
        self.add(&sums, *dy);
    }

    fn add(&mut self, row: &Row<ROWS, COLUMNS>, dy: i32) {
        let drop = Bits::<ROWS, COLUMNS>::ROW;
        // A row within reach lies within two radii, so this fits; for other rows the sums are 0.
        let dy = dy << (32 - PLACE_BITS - drop);
        let [ss, sx, sy, xx, xy, yy] = &mut self.matrix;
        *ss += row.height_height >> drop;
        *sx -= row.height_x >> drop;
        *sy -= high(row.height_square, dy);
        *xx += row.x_x >> drop;
        *xy += high(row.square_x, dy);
        *yy += high(high(row.square_square, dy), dy) << drop;
        let [s, x, y] = &mut self.right;
        *s -= row.height >> drop;
        *x += row.x >> drop;
        *y += high(row.square, dy);
        self.misfit.add_row::<ROWS, COLUMNS>(&row.misfit);
    }

    /// Solves for the next guess.
    pub fn solve(&self, guess: &Guess, scale: &PeakScale, geometry: &Geometry) -> Guess {
        let [ss, sx, sy, xx, xy, yy] = self.matrix;
        let [s, x, y] = self.right;
        let divisor = |left: i32, of: i32| Divisor::new(left.max(of >> GUARD_BITS).max(1).unsigned_abs().into());
        let times = |share: i32, of: i32| ((i64::from(share) * i64::from(of)) >> SHARE_BITS) as i32;

        // The change of ln(s) is eliminated, then that of x.
        let by_ss = divisor(ss, ss);
        let share_x = by_ss.divide(sx.into(), SHARE_BITS);
        let share_y = by_ss.divide(sy.into(), SHARE_BITS);
        let left_xx = xx - times(share_x, sx);
        let left_xy = xy - times(share_x, sy);
        let (left_x, left_y) = (x - times(share_x, s), y - times(share_y, s));
        let by_xx = divisor(left_xx, xx);
        let share = by_xx.divide(left_xy.into(), SHARE_BITS);
        let by_yy = divisor(yy - times(share_y, sy) - times(share, left_xy), yy);
        let y_step = by_yy.divide((left_y - times(share, left_x)).into(), SHARE_BITS);
        let x_step = by_xx.divide((left_x - times(y_step, left_xy)).into(), SHARE_BITS);
        let height_step = by_ss.divide((s - times(x_step, sx) - times(y_step, sy)).into(), SHARE_BITS);

        // Slopes count Y and residuals the peak, so the solution is divided by Y over the peak.
        let drop = 62 - scale.modulus_shift - SLOPE_BITS - (28 - SHARE_BITS);
        let scaled = |step: i32| clamp_to((i64::from(step) * i64::from(scale.inverse_modulus)) >> drop, i32::MAX);
        let change = clamp_to(scaled(height_step).into(), HEIGHT_STEP);
        let height = guess.height + (high(guess.height, change) << 4);
        let height_square = guess.height_square();
        let moved = |centre: i32, step: i32| {
            let wide = (i64::from(height_square) * i64::from(scaled(step))) >> (56 - CENTRE_BITS);
            centre + clamp_to(wide, CENTRE_STEP)
        };
        Guess::new(height, moved(guess.x, x_step), moved(guess.y, y_step), geometry)
    }
}
