//! Robust statistics and least squares.

use nalgebra::{DMatrix, DVector};

/// Threshold of Huber's weights, in standard deviations: 95 % efficient for normal errors (Huber and Ronchetti, Robust
/// Statistics, 2009, section 4.5).
pub const HUBER: f64 = 1.345;
/// Standard deviation of a normal distribution over its median absolute deviation.
const NORMAL: f64 = 1.4826;

/// Weight of a residual that is in standard deviations: 1 up to a threshold, falling with the inverse beyond.
pub fn huber(residual: f64, threshold: f64) -> f64 {
    threshold / residual.abs().max(threshold)
}

/// Cost of a residual that is in standard deviations: the square up to a threshold, a line beyond.
pub fn huber_cost(residual: f64, threshold: f64) -> f64 {
    let size = residual.abs();
    if size <= threshold { size * size } else { threshold * (2.0 * size - threshold) }
}

/// Median; 0 of nothing.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        odd if odd % 2 == 1 => values[odd / 2],
        even => 0.5 * (values[even / 2 - 1] + values[even / 2]),
    }
}

/// Standard deviation about 0 from the median absolute value.
pub fn spread(residuals: impl Iterator<Item = f64>) -> f64 {
    NORMAL * median(residuals.map(f64::abs).collect())
}

#[derive(Clone, Debug)]
pub struct Fit {
    pub unknowns: DVector<f64>,
    /// Their covariance for residuals of a standard deviation of 1.
    pub covariance: DMatrix<f64>,
    /// Sum of the squared residuals, robustly weighted.
    pub cost: f64,
}

/// Levenberg and Marquardt's method with Huber's weights and numerical slopes, for few unknowns.
///
/// `residuals` are in standard deviations. `sizes` are the steps of the slopes: a hundredth of what an unknown may
/// change by.
pub fn minimise(start: &[f64], sizes: &[f64], residuals: impl Fn(&DVector<f64>) -> DVector<f64>) -> Option<Fit> {
    let mut unknowns = DVector::from_column_slice(start);
    let mut now = residuals(&unknowns);
    let mut damping = 1e-3;
    for _ in 0..60 {
        let (normal, gradient) = equations(&unknowns, &now, sizes, &residuals);
        let cost = cost(&now);
        let mut gained = 0.0;
        while damping < 1e9 {
            let mut damped = normal.clone();
            (0..start.len()).for_each(|i| damped[(i, i)] *= 1.0 + damping);
            let trial = &unknowns - damped.cholesky()?.solve(&gradient);
            let there = residuals(&trial);
            let there_cost = self::cost(&there);
            if there_cost < cost {
                gained = 1.0 - there_cost / cost;
                (unknowns, now, damping) = (trial, there, damping * 0.2);
                break;
            }
            damping *= 5.0;
        }
        if gained < 1e-7 {
            break;
        }
    }
    let (normal, _) = equations(&unknowns, &now, sizes, &residuals);
    let covariance = normal.cholesky()?.inverse();
    Some(Fit { unknowns, covariance, cost: cost(&now) })
}

fn cost(residuals: &DVector<f64>) -> f64 {
    residuals.iter().map(|residual| huber_cost(*residual, HUBER)).sum()
}

fn equations(
    unknowns: &DVector<f64>,
    now: &DVector<f64>,
    sizes: &[f64],
    residuals: &impl Fn(&DVector<f64>) -> DVector<f64>,
) -> (DMatrix<f64>, DVector<f64>) {
    let slopes = DMatrix::from_columns(&Vec::from_iter(sizes.iter().enumerate().map(|(i, size)| {
        let mut aside = unknowns.clone();
        aside[i] += size;
        (residuals(&aside) - now) / *size
    })));
    let weights = now.map(|residual| huber(residual, HUBER));
    let weighted = DMatrix::from_fn(now.len(), sizes.len(), |row, column| weights[row] * slopes[(row, column)]);
    (weighted.transpose() * &slopes, weighted.transpose() * now)
}
