//! The model's prediction of each taxel from a guess of the contact, and one refinement of the guess: the weighted
//! normal equations of all live taxels, and their solution.
//!
//! The unknowns are scaled so that every slope is at most about 1: the change of ln(s), and the centre's in units of
//! s^2. A reading's error grows with the reading, so a taxel's weight falls with the model's pressure, from 1 to 1/4 at
//! the peak.

use crate::arith::{Divisor, between, clamp_to, high, reciprocal, root};
use crate::config::Shaped;
use crate::config::array::{Geometry, NODE_BITS, NODES, Node, ONE, PLACE_BITS, SQUARE_BITS};
use crate::model::Tip;
use crate::pressure::{CODE_BITS, TactileImage};
use crate::units::Millimetres;

/// Fractional bits of a centre.
pub const CENTRE_BITS: u32 = 24;
/// Fractional bits of a slope.
pub const SLOPE_BITS: u32 = 13;
/// Least s, for the deepest indentation of the fit: 7/8 of the radius.
pub const HEIGHT_MIN: i32 = ONE / 8;
/// Largest s, for the shallowest indentation of the fit: 1/1024 of the radius.
pub const HEIGHT_MAX: i32 = ONE - ONE / 1024;
/// Largest squared distance of a taxel that a contact can reach.
const SQUARE_MAX: u32 = 3 << (SQUARE_BITS - 1);

/// Guess of a contact, in tip radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guess {
    /// s = 1 - d, Q28.
    pub height: i32,
    /// Centre, Q24.
    pub x: i32,
    /// Centre, Q24.
    pub y: i32,
}

impl Guess {
    /// Returns the nearest guess that the fit covers: the centre within a radius of the array.
    pub fn new(height: i32, x: i32, y: i32, geometry: &Geometry) -> Self {
        let [reach_x, reach_y] = geometry.reach;
        let centre = |value: i32, reach: i32| clamp_to(value.into(), reach);
        Self { height: height.min(HEIGHT_MAX).max(HEIGHT_MIN), x: centre(x, reach_x), y: centre(y, reach_y) }
    }

    /// Converts lengths to a guess.
    pub fn from_lengths(d: Millimetres, x: Millimetres, y: Millimetres, geometry: &Geometry) -> Self {
        let share = |length: Millimetres, bits: u32| {
            let wide = i64::from(length.to_bits()) * i64::from(geometry.inverse_radius);
            clamp_to(wide >> (56 - bits), i32::MAX)
        };
        Self::new(ONE - share(d, SQUARE_BITS), share(x, CENTRE_BITS), share(y, CENTRE_BITS), geometry)
    }

    /// Indentation.
    pub fn indentation(&self, tip: &Tip) -> Millimetres {
        Millimetres::from_bits(scale(ONE - self.height, tip, SQUARE_BITS))
    }

    /// Centre along the columns and along the rows.
    pub fn centre(&self, tip: &Tip) -> [Millimetres; 2] {
        [self.x, self.y].map(|value| Millimetres::from_bits(scale(value, tip, CENTRE_BITS)))
    }

    /// s^2, Q28.
    pub fn height_square(&self) -> i32 {
        high(self.height, self.height) << 4
    }

    /// r_c^2 = 1 - s^2, Q28.
    pub fn rim_square(&self) -> i32 {
        ONE - self.height_square()
    }
}

/// Converts a number of radii to a length.
fn scale(radii: i32, tip: &Tip, bits: u32) -> i32 {
    ((i64::from(radii) * i64::from(tip.radius().to_bits())) >> bits) as i32
}

/// Prediction of a taxel: pressure as a share of the peak, and its slopes.
#[derive(Clone, Copy, Debug, Default)]
pub struct TaxelModel {
    /// Pressure, Q14 of the peak.
    pub pressure: i32,
    /// Slope of the pressure over ln(s), in Y, Q13: `-dp / d ln(s)`.
    pub by_height: i32,
    /// Slope of the pressure over the squared distance, negative, times 2 s^2, in Y, Q13.
    pub by_square: i32,
}

/// Prediction of all taxels from a guess.
#[derive(Clone, Debug)]
pub struct Prediction<const ROWS: usize, const COLUMNS: usize> {
    /// s, Q28.
    pub height: i32,
    /// s^3, Q27.
    height_cube_q27: i32,
    /// Squared distance below which a taxel lies inside the contact.
    pub inside: u32,
    /// Squared distance from which on a taxel lies outside the contact.
    pub outside: u32,
    /// Twice the modulus in shares of the peak, Q14.
    twice_modulus: i32,
    modulus: i32,
    modulus_shift: u32,
    /// Places of the columns relative to the contact's centre, Q15.
    pub dx: [i32; COLUMNS],
    /// Squares of these places, Q28.
    pub dx_square: [u32; COLUMNS],
    /// Places of the rows relative to the contact's centre, Q15.
    pub dy: [i32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Prediction<ROWS, COLUMNS> {
    /// Prediction of no contact.
    pub const NONE: Self = Self {
        height: 0,
        height_cube_q27: 0,
        inside: 0,
        outside: 0,
        twice_modulus: 0,
        modulus: 0,
        modulus_shift: 0,
        dx: [0; COLUMNS],
        dx_square: [0; COLUMNS],
        dy: [0; ROWS],
    };

    /// Predicts the taxels from a guess, in shares of this scale's peak.
    pub fn new(guess: &Guess, scale: &PeakScale, config: &Shaped<ROWS, COLUMNS>) -> Self {
        let geometry = &config.geometry;
        // The rim's radius, widened by what a taxel's size adds to its mean squared distance, Q15.
        let widened = guess.rim_square() + high(geometry.pitch, geometry.pitch) / 12 * 16;
        let middle = root((widened as u32) << 2) as i32;
        let half = geometry.pitch >> (SQUARE_BITS - PLACE_BITS + 1);
        let square_of = |place: i32| square(place.max(0)).min(SQUARE_MAX);
        let dx = from(&config.columns, guess.x);
        Self {
            height: guess.height,
            height_cube_q27: high(guess.height_square(), guess.height) << 3,
            inside: square_of(middle - half),
            outside: square_of(middle + half),
            twice_modulus: 2 * scale.modulus,
            modulus: scale.modulus << scale.modulus_shift,
            modulus_shift: scale.modulus_shift,
            dx,
            dx_square: dx.map(square),
            dy: from(&config.rows, guess.y),
        }
    }

    /// Predicts a taxel's pressure alone, as [`Prediction::taxel`]. Not inlined: few taxels of a row lie in a contact, and
    /// the loop over the row then keeps its values in registers.
    #[inline(never)]
    fn pressure(&self, square: u32, geometry: &Geometry) -> i32 {
        self.taxel(square, &geometry.nodes).pressure
    }

    /// Predicts a taxel at a squared distance below [`Prediction::outside`].
    #[inline(always)]
    pub fn taxel(&self, square: u32, nodes: &[Node; NODES]) -> TaxelModel {
        let ([low, up], share) = interval(nodes, square);
        if square < self.inside {
            let rise = up.mean_inverse_length - low.mean_inverse_length;
            let mean = low.mean_inverse_length + 2 * high(rise, share);
            let left_q22 = high(self.height, mean);
            let strain_q22 = ((1 << 22) - left_q22).max(0);
            return TaxelModel {
                pressure: high(strain_q22 << 9, self.twice_modulus),
                by_height: left_q22 >> (22 - SLOPE_BITS),
                by_square: high(rise, self.height_cube_q27),
            };
        }
        let length = between(low.near_length, up.near_length, share);
        let compressed = (length - self.height).max(0);
        // (L1 - s) / (h r), Q14, below 8.
        let ratio = high(compressed, between(low.inverse_spread, up.inverse_spread, share)).min((8 << 14) - 1);
        // Under the rim the column is hardly longer than s, so both slopes are taken as equal.
        let slope = high(ratio << 3, self.height).min(3 << (SLOPE_BITS - 1));
        TaxelModel {
            pressure: high(high(compressed, self.modulus), ratio << 14) >> (self.modulus_shift - 7),
            by_height: slope,
            by_square: slope,
        }
    }
}

/// Returns places relative to a centre, Q15.
#[inline(always)]
fn from<const SIDE: usize>(places: &[i32; SIDE], centre: i32) -> [i32; SIDE] {
    places.map(|place| place - (centre >> (CENTRE_BITS - PLACE_BITS)))
}

/// Returns the nodes around a squared distance, and its relative position between them in Q31.
#[inline(always)]
pub fn interval(nodes: &[Node; NODES], square: u32) -> ([&Node; 2], i32) {
    let index = ((square >> NODE_BITS) as usize).min(NODES - 2);
    ([&nodes[index], &nodes[index + 1]], ((square << (32 - NODE_BITS)) >> 1) as i32)
}

/// Returns the square of a place, Q28, at most 4.
#[inline(always)]
pub fn square(place: i32) -> u32 {
    let place = place.unsigned_abs().min(u32::from(u16::MAX));
    (place * place) >> 2
}

/// Fractional bits of a pressure as a share of the peak.
pub const PEAK_BITS: u32 = 14;
/// Lowest peak that is fitted: one code.
const PEAK_MIN: i32 = 1 << CODE_BITS;
/// Highest peak that converter, sag and gain allow.
const PEAK_MAX: i32 = 1 << 18;
/// Largest modulus as a share of the peak: 512. Below that indentation of a / 512 the model gives no more than the
/// sum.
const MODULUS_MAX: u32 = 1 << (PEAK_BITS + 9);
/// Least modulus as a share of the peak. With less, the tip would be pressed flat.
const MODULUS_MIN: u32 = 1 << (PEAK_BITS - 1);

/// Tactile image and its scale.
pub struct ScaledImage<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Tactile image.
    pub picture: &'a TactileImage<ROWS, COLUMNS>,
    /// Scale by the image's peak.
    pub scale: &'a PeakScale,
}

/// Scale of an image to shares of its highest taxel: 2^14 is the peak, so products fit 32 bits whatever the load.
#[derive(Clone, Copy, Debug)]
pub struct PeakScale {
    /// 2^34 over the peak.
    inverse_peak: i32,
    /// Y in shares of the peak, Q14.
    pub modulus: i32,
    /// Left shift that puts the modulus' top bit at 30.
    pub modulus_shift: u32,
    /// 2^(62 - modulus_shift) over the modulus.
    pub inverse_modulus: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> ScaledImage<'_, ROWS, COLUMNS> {
    /// Returns a taxel as a share of the peak, Q14. Taxels below -2^18 have no meaning.
    #[inline(always)]
    pub fn share(&self, taxel: i32) -> i32 {
        self.scale.share(taxel)
    }
}

impl PeakScale {
    /// Scale of no contact.
    pub const NONE: Self = Self { inverse_peak: 0, modulus: 0, modulus_shift: 0, inverse_modulus: 0 };

    /// Scale by a peak; none if the peak is too low for the model.
    pub fn new(peak: i32, geometry: &Geometry) -> Option<Self> {
        if peak < PEAK_MIN {
            return None;
        }
        let divisor = peak.min(PEAK_MAX).unsigned_abs();
        let (whole, rest) = (geometry.modulus_q8 / divisor, geometry.modulus_q8 % divisor);
        if whole >= MODULUS_MAX >> (PEAK_BITS - 8) {
            return None;
        }
        let modulus = ((whole << (PEAK_BITS - 8)) + (rest << (PEAK_BITS - 8)) / divisor).max(MODULUS_MIN);
        let modulus_shift = modulus.leading_zeros() - 1;
        Some(Self {
            inverse_peak: (reciprocal(divisor << divisor.leading_zeros()) >> (29 - divisor.leading_zeros())) as i32,
            modulus: modulus as i32,
            modulus_shift,
            inverse_modulus: reciprocal(modulus << (modulus_shift + 1)),
        })
    }

    /// Returns a taxel as a share of the peak, Q14. Taxels below -2^18 have no meaning.
    #[inline(always)]
    pub fn share(&self, taxel: i32) -> i32 {
        high(taxel << (PEAK_BITS - 2), self.inverse_peak)
    }

    /// Square of the converter's resolution as a share: a third of a code's square.
    pub fn converter_square(&self) -> u32 {
        let code = self.share(1 << CODE_BITS).unsigned_abs();
        code * code / 3
    }
}

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
        let (scale, dy_square, outside) = (*view.scale, square(*dy), prediction.outside);
        let mut row = Self::NONE;
        let mut bad = *bad;
        for (taxel, dx_square) in taxels.iter().zip(&prediction.dx_square) {
            if bad & 1 == 0 {
                let at = dx_square + dy_square;
                let share = scale.share(*taxel);
                if at < outside {
                    row.taxels += 1;
                    let residual = residual(share - prediction.pressure(at, geometry));
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

    #[inline(always)]
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
