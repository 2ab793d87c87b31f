//! The joint least squares over all strokes.

use super::model::{ALL, FITTED, FORMS, Law, Parameters, Path, index};
use super::{NoDrive, Record};
use crate::robust::{huber, huber_cost};
use nalgebra::{Cholesky, Matrix3, SMatrix, SVector, Vector3};

pub type Vector = SVector<f64, ALL>;
type Matrix = SMatrix<f64, ALL, ALL>;

/// Rounds at most, and the square of the whole step, in standard deviations, below which they end.
const ROUNDS: usize = 100;
const SMALL: f64 = 0.1;
/// Residuals beyond this many times their scale count in proportion only (Huber).
const HUBER: f64 = 2.0;
/// Share of the root mean square of the residuals that their scale is at least.
const OUTLIERS: f64 = 0.4;
/// A cost that falls by less than this share in the second half of the rounds has reached its minimum.
const FLAT: f64 = 0.01;
/// The scale of the residuals is kept while it changes by less than this share.
const STEADY: f64 = 0.05;
/// Step of a parameter for its derivative.
const NUDGE: f64 = 1e-5;
/// Prior of the Stribeck speed: its logarithm and standard deviation.
const SPEED: [f64; 2] = [2.3, 1.0];
/// Prior standard deviation of what standstill adds to friction: a share of friction, and V.
const STANDSTILL: [f64; 2] = [0.5, 0.02];
/// First guess of the time constant, s.
const TAU_S: f64 = 9e-3;
/// Largest change of a parameter in a round.
const STEP: f64 = 0.7;
/// Speed at the start of a path at least, rad/s.
const SPEED_LEAST: f64 = 0.05;
/// Ratio `Fit::common` from which friction counts as different from path to path. The deviation between paths is
/// `EVEN_V` (V) below that ratio, and the share `UNEVEN` of the friction voltage above it.
const COMMON: f64 = 4.0;
const EVEN_V: f64 = 1e-6;
const UNEVEN: f64 = 0.05;

/// The fit with one form of friction.
pub struct Fit {
    pub p: Parameters,
    /// Sum of squares of the residuals, rad^2.
    pub cost: f64,
    /// Samples that count as independent.
    independent: f64,
    /// Variance of k by the strokes' scatter, as a multiple of that by the samples' scatter.
    common: f64,
    scatter: Matrix,
    /// Parameters that are not fitted: the value of each if it were, its uncertainty, and the change of the others.
    pub probes: Vec<(f64, f64, Vector)>,
}

/// A path's own unknowns: angle and speed at its first sample, and the voltage of its friction beside the law.
pub type Own = Vector3<f64>;

/// Normal equations of one path: of the parameters, of its own unknowns, and between them.
struct Block {
    stroke: usize,
    matrix: Matrix,
    gradient: Vector,
    corner: Matrix3<f64>,
    side: SMatrix<f64, 3, ALL>,
    own: Own,
}

/// Normal equations of the parameters, the paths' own unknowns eliminated.
struct Normal {
    matrix: Matrix,
    gradients: Vec<Vector>,
    /// Derivatives of the unknowns of each path by the parameters.
    follow: Vec<(Own, SMatrix<f64, 3, ALL>)>,
}

struct Problem<'a> {
    paths: &'a [Path],
    law: Law,
    /// Least standard deviation of a sample: that of the encoder's steps.
    least: f64,
    /// Mean and weight of each parameter's prior.
    prior: [(f64, f64); FITTED],
    /// Standard deviation of the paths' own friction, V.
    uneven_v: f64,
}

#[derive(Clone)]
struct Point {
    p: Parameters,
    own: Vec<Own>,
}

impl Problem<'_> {
    /// Cost of the residuals and of the prior.
    fn cost(&self, residuals: &[Vec<f64>], at: &Point, scale: f64) -> f64 {
        let prior = self.prior.iter().zip(&at.p).map(|((mean, weight), p)| weight * (p - mean).powi(2));
        let uneven = at.own.iter().map(|own| (own[2] / self.uneven_v).powi(2));
        prior.sum::<f64>()
            + uneven.sum::<f64>()
            + residuals.iter().flatten().map(|residual| huber_cost(residual / scale, HUBER)).sum::<f64>()
    }

    /// Normal equations with the prior: matrix and gradient of the fitted parameters, 1 and 0 for the others.
    fn equations(&self, normal: &Normal, p: &Parameters, damping: f64) -> (Matrix, Vector) {
        let (mut matrix, mut gradient) = (Matrix::identity(), Vector::zeros());
        let sum: Vector = normal.gradients.iter().sum();
        for at in 0..FITTED {
            let (mean, weight) = self.prior[at];
            for other in 0..FITTED {
                matrix[(at, other)] = normal.matrix[(at, other)];
            }
            matrix[(at, at)] = (matrix[(at, at)] + weight) * (1.0 + damping) + 1e-12;
            gradient[at] = sum[at] + weight * (p[at] - mean);
        }
        (matrix, gradient)
    }

    fn blocks(&self, at: &Point, residuals: &[Vec<f64>], scale: f64, parameters: usize) -> Vec<Block> {
        let all = self.paths.iter().zip(&at.own).zip(residuals);
        let block = |((path, own), residuals): ((&Path, &Own), &Vec<f64>)| {
            let mut block = Block::new((path, own, residuals), &at.p, self.law, scale, parameters);
            block.corner[(2, 2)] += self.uneven_v.powi(-2);
            block.own[2] += own[2] * self.uneven_v.powi(-2);
            block
        };
        all.map(block).collect()
    }

    /// The least cost near a point, by damped Gauss-Newton steps (Levenberg and Marquardt).
    fn minimum(&self, mut at: Point) -> Result<Point, NoDrive> {
        let mut damping = 1e-3;
        let (mut rounds, mut scale, mut halfway) = (0, 0.0, f64::MAX);
        loop {
            let residuals = residuals(self.paths, &at.p, self.law, &at.own);
            // Kept once it hardly changes: costs by different scales cannot be compared.
            let now = self::scale(&residuals).max(self.least);
            if (now - scale).abs() > STEADY * scale {
                (scale, halfway) = (now, f64::MAX);
            }
            let before = self.cost(&residuals, &at, scale);
            let blocks = self.blocks(&at, &residuals, scale, FITTED);
            let (matrix, gradient) = self.equations(&Normal::new(&blocks, 0.0), &at.p, 0.0);
            let whole = Cholesky::new(matrix).map_or(f64::MAX, |factors| gradient.dot(&factors.solve(&gradient)));
            if whole < SMALL {
                return Ok(at);
            }
            if rounds < ROUNDS / 2 {
                halfway = before;
            }
            loop {
                rounds += 1;
                if rounds > ROUNDS {
                    // The cost is flat around its minimum: a lower one would not change what is known of the motor.
                    return if halfway < (1.0 + FLAT) * before { Ok(at) } else { Err(NoDrive::Unsolved(ROUNDS)) };
                }
                let normal = Normal::new(&blocks, damping);
                let (matrix, gradient) = self.equations(&normal, &at.p, damping);
                let step = Cholesky::new(matrix).map_or(Vector::zeros(), |factors| -factors.solve(&gradient));
                let next = at.after(&step.map(|part| part.clamp(-STEP, STEP)), &normal);
                let residuals = self::residuals(self.paths, &next.p, self.law, &next.own);
                if self.cost(&residuals, &next, scale) <= before {
                    at = next;
                    damping = (damping * 0.2).max(1e-9);
                    break;
                }
                damping *= 8.0;
            }
        }
    }

    fn judged(&self, at: &Point) -> Fit {
        let Self { paths, law, least, .. } = *self;
        let residuals = residuals(paths, &at.p, law, &at.own);
        let scale = scale(&residuals).max(least);
        let normal = Normal::new(&self.blocks(at, &residuals, scale, ALL), 0.0);
        let strokes = normal.gradients.iter().filter(|gradient| gradient.norm() > 0.0).count() as f64;
        // The strokes' gradients scatter about 0.
        let mut spread = normal.gradients.iter().map(|g| g * g.transpose()).sum::<Matrix>();
        spread *= strokes / (strokes - FITTED as f64).max(1.0);
        let mut matrix = normal.matrix;
        for (at, (_, weight)) in self.prior.iter().enumerate() {
            matrix[(at, at)] += weight;
            spread[(at, at)] += weight;
        }
        let solve = |extra: Option<usize>| {
            let free = |at: usize| at < FITTED || Some(at) == extra;
            let mask = Matrix::from_fn(|row, column| f64::from(u8::from(free(row) && free(column))));
            let mut masked = matrix.component_mul(&mask);
            for at in (0..ALL).filter(|at| !free(*at)) {
                masked[(at, at)] = 1.0;
            }
            let inverse = masked.try_inverse().unwrap_or_else(Matrix::identity).component_mul(&mask);
            (inverse, inverse * spread * inverse)
        };
        let (naive, sandwich) = solve(None);
        let gradient: Vector = normal.gradients.iter().sum();
        let probes = (FITTED..ALL).map(|extra| {
            let (inverse, sandwich) = solve(Some(extra));
            // The fitted parameters' gradients are balanced by the prior: only the extra one's moves anything.
            let step = -inverse.column(extra) * gradient[extra];
            (step[extra], (sandwich[(extra, extra)] + inverse[(extra, extra)]).sqrt(), step)
        });
        let cost: f64 = residuals.iter().flatten().map(|residual| residual * residual).sum();
        let samples = residuals.iter().map(Vec::len).sum::<usize>() as f64;
        let common = (sandwich[(index::K, index::K)] / naive[(index::K, index::K)]).max(1.0);
        Fit {
            p: at.p,
            cost,
            common,
            independent: samples / common,
            scatter: naive + sandwich,
            probes: probes.collect(),
        }
    }
}

impl Point {
    /// The point after a step of the parameters; the paths' own unknowns follow.
    fn after(&self, step: &Vector, normal: &Normal) -> Self {
        let own = self.own.iter().zip(&normal.follow).map(|(own, (step_own, follows))| {
            let own = own - (step_own + follows * step);
            Own::new(own[0], own[1].max(SPEED_LEAST), own[2])
        });
        Self { p: core::array::from_fn(|at| self.p[at] + step[at]), own: own.collect() }
    }
}

impl Fit {
    /// Fits of all forms of friction, the best one first.
    ///
    /// First with one friction for all strokes. Where they do not agree on one, each path may have its own beside it.
    pub fn all(paths: &[Path], record: &Record, slowest: f64) -> Result<Vec<Self>, NoDrive> {
        let mut failed = NoDrive::Unsolved(0);
        for even in [true, false] {
            let mut fits = Vec::new();
            for share in FORMS {
                match Self::new(paths, Law { share, slowest }, record, even) {
                    Ok(fit) => fits.push(fit),
                    Err(refusal) => failed = refusal,
                }
            }
            fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
            if fits.first().is_some_and(|best| !even || best.common < COMMON) {
                return Ok(fits);
            }
        }
        Err(failed)
    }

    fn new(paths: &[Path], law: Law, record: &Record, even: bool) -> Result<Self, NoDrive> {
        let least = core::f64::consts::TAU / record.counts_per_turn / 12_f64.sqrt();
        let point = guess(paths);
        let mut prior = [(0.0, 0.0); FITTED];
        prior[index::SPEED] = (SPEED[0], SPEED[1].powi(-2));
        let coulomb = point.p[index::COULOMB].exp();
        for side in [0, 1] {
            prior[index::STRIBECK + side] = (0.0, (STANDSTILL[0] * coulomb + STANDSTILL[1]).powi(-2));
        }
        let uneven_v = if even { EVEN_V } else { UNEVEN * coulomb };
        let problem = Problem { paths, law, least, prior, uneven_v };
        Ok(problem.judged(&problem.minimum(point)?))
    }

    /// Weights of fits with other forms of friction by how well they fit, this one's being the largest.
    pub fn weights(&self, fits: &[Self]) -> Vec<f64> {
        let weight = |fit: &Self| (-0.5 * self.independent * (fit.cost / self.cost - 1.0)).exp();
        let sum: f64 = fits.iter().map(weight).sum();
        fits.iter().map(|fit| weight(fit) / sum).collect()
    }

    /// Variance of a value with this gradient, from scatter and from what the model could be instead.
    pub fn variance(&self, gradient: &Vector, fits: &[Self]) -> f64 {
        let scatter = gradient.dot(&(self.scatter * gradient));
        let probes: f64 = self.probes.iter().map(|(_, _, step)| masked(step).dot(gradient).powi(2)).sum();
        let weights = self.weights(fits);
        let values: Vec<f64> = fits.iter().map(|fit| Vector::from(fit.p).dot(gradient)).collect();
        let mean: f64 = values.iter().zip(&weights).map(|(value, weight)| value * weight).sum();
        let forms: f64 = values.iter().zip(&weights).map(|(value, weight)| weight * (value - mean).powi(2)).sum();
        scatter + probes + forms
    }
}

/// The part of a vector that belongs to fitted parameters.
fn masked(vector: &Vector) -> Vector {
    Vector::from_fn(|at, _| if at < FITTED { vector[at] } else { 0.0 })
}

impl Block {
    /// Residuals of a path, their derivatives by the first `parameters`, in units of `scale`.
    fn new(
        (path, unknowns, residuals): (&Path, &Own, &[f64]),
        p: &Parameters,
        law: Law,
        scale: f64,
        parameters: usize,
    ) -> Self {
        let mut nudged = Vec::new();
        let mut shared = vec![Vector::zeros(); residuals.len()];
        let slope = |angles: &[f64], at: usize| (angles[at] - path.angles[at] - residuals[at]) / (NUDGE * scale);
        for parameter in 0..parameters {
            let mut other = *p;
            other[parameter] += NUDGE;
            path.angles(&other, law, unknowns, &mut nudged);
            for (at, row) in shared.iter_mut().enumerate() {
                row[parameter] = slope(&nudged, at);
            }
        }
        let mut own = vec![Own::new(1.0 / scale, 0.0, 0.0); residuals.len()];
        for unknown in [1, 2] {
            let mut other = *unknowns;
            other[unknown] += NUDGE;
            path.angles(p, law, &other, &mut nudged);
            for (at, row) in own.iter_mut().enumerate() {
                row[unknown] = slope(&nudged, at);
            }
        }
        let mut block = Self {
            stroke: path.stroke,
            matrix: Matrix::zeros(),
            gradient: Vector::zeros(),
            corner: Matrix3::zeros(),
            side: SMatrix::zeros(),
            own: Own::zeros(),
        };
        for ((row, own), residual) in shared.iter().zip(&own).zip(residuals) {
            let residual = residual / scale;
            let weight = huber(residual, HUBER);
            block.matrix += row * row.transpose() * weight;
            block.gradient += row * (weight * residual);
            block.corner += own * own.transpose() * weight;
            block.side += own * row.transpose() * weight;
            block.own += own * (weight * residual);
        }
        block
    }
}

impl Normal {
    fn new(blocks: &[Block], damping: f64) -> Self {
        let mut normal = Self { matrix: Matrix::zeros(), gradients: Vec::new(), follow: Vec::new() };
        for block in blocks {
            let mut corner = block.corner;
            for at in 0..3 {
                corner[(at, at)] = corner[(at, at)] * (1.0 + damping) + 1e-9;
            }
            let inverse = corner.try_inverse().unwrap_or_else(Matrix3::zeros);
            let follows = inverse * block.side;
            normal.matrix += block.matrix - block.side.transpose() * follows;
            normal.gradients.resize(block.stroke + 1, Vector::zeros());
            normal.gradients[block.stroke] += block.gradient - follows.transpose() * block.own;
            normal.follow.push((inverse * block.own, follows));
        }
        normal
    }
}

fn residuals(paths: &[Path], p: &Parameters, law: Law, own: &[Own]) -> Vec<Vec<f64>> {
    let of = |(path, own): (&Path, &Own)| {
        let mut angles = Vec::with_capacity(path.angles.len());
        path.angles(p, law, own, &mut angles);
        angles.iter().zip(&path.angles).map(|(angle, recorded)| angle - recorded).collect()
    };
    paths.iter().zip(own).map(of).collect()
}

/// Standard deviation of residuals by their median, which outliers do not change; at least [`OUTLIERS`] of the root of
/// their mean square, so that a stroke which the parameters do not follow yet still counts.
fn scale(residuals: &[Vec<f64>]) -> f64 {
    let mut all: Vec<f64> = residuals.iter().flatten().map(|residual| residual.abs()).collect();
    let middle = all.len() / 2;
    let square = all.iter().map(|residual| residual * residual).sum::<f64>() / all.len() as f64;
    (1.4826 * *all.select_nth_unstable_by(middle, f64::total_cmp).1).max(OUTLIERS * square.sqrt())
}

/// First guess: a line through the strokes' voltages over their largest speeds.
fn guess(paths: &[Path]) -> Point {
    let strokes = paths.len() as f64;
    let mean = |of: fn(&Path) -> f64| paths.iter().map(of).sum::<f64>() / strokes;
    let (speed, voltage) = (mean(|path| path.fastest), mean(|path| path.voltage_v));
    let (mut above, mut below) = (0.0, 0.0);
    for path in paths {
        above += (path.fastest - speed) * (path.voltage_v - voltage);
        below += (path.fastest - speed).powi(2);
    }
    let most = voltage / speed;
    let k = (above / below).clamp(0.1 * most, 0.95 * most);
    let coulomb = voltage - k * speed;
    let mut p = [0.0; ALL];
    p[index::K] = k.ln();
    p[index::A] = (k * TAU_S).ln();
    p[index::COULOMB] = coulomb.ln();
    p[index::COULOMB + 1] = coulomb.ln();
    p[index::SPEED] = SPEED[0];
    Point { p, own: paths.iter().map(|path| Own::new(0.0, path.speed.max(SPEED_LEAST), 0.0)).collect() }
}
