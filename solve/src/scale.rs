//! The array's scale, from forces read on a kitchen scale.
//!
//! A press shows Y times the gain that all taxels have in common: a harder tip under less sensitive taxels reads the same. A
//! scale shows the force itself:
//!
//! ```text
//! F = k R + b + q R^2
//! ```
//!
//! with R the array's sum. k divides `codes_per_kpa` and multiplies the modulus. b and q are zero for a sound array: where
//! they differ from zero by three of their uncertainties they hint at a scale that was not zeroed, and at a characteristic
//! that is no line (`curve_permille`). Least squares with Huber's weights: one number that was misread does not move k.

use crate::Value;
use crate::robust::{Fit, minimise};
use nalgebra::DVector;

/// Goals before a held force, as shares of it: one above, then one below. An array with hysteresis reads less while
/// the force rises than while it falls; these goals bring the reading between the two.
pub const SWINGS: [f64; 2] = [1.06, 0.98];

/// A force that was held on a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Force that the scale shows, N.
    pub shown_n: f64,
    /// Force that the array reads meanwhile by its sum, creep and temperature taken off, N.
    pub read_n: f64,
}

/// Scale of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Force shown over force read.
    pub factor: Value,
    /// Force shown where the array reads none, N. None from a single force.
    pub offset_n: Option<Value>,
    /// Change of the factor at the largest force, as a share. None from fewer than three forces.
    pub curve: Option<Value>,
}

/// Reason why there is no scale, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "their texts say it")]
pub enum NoScale {
    #[error("the largest force is {0:.3} N; 0.1 N is needed")]
    TooLittle(f64),
    #[error("the scale shows {0:.2} of what the array reads; a half to two is allowed")]
    Range(f64),
}

/// Half a step of a kitchen scale with its repeatability, N.
const SHOWN_N: f64 = 0.005;
/// Change by creep and hysteresis from hold to hold, as a share.
const HELD_PART: f64 = 0.01;
const LEAST_N: f64 = 0.1;

/// Scale by forces that were held.
pub fn scale(held: &[Held]) -> Result<Scale, NoScale> {
    let largest_n = held.iter().map(|held| held.read_n).fold(0.0, f64::max);
    if largest_n < LEAST_N || held.iter().all(|held| held.shown_n < LEAST_N) {
        return Err(NoScale::TooLittle(largest_n));
    }
    let (factor, _) = line(held, 1, largest_n).ok_or(NoScale::TooLittle(largest_n))?;
    if !(0.5..=2.0).contains(&factor.value) {
        return Err(NoScale::Range(factor.value));
    }
    let last =
        |terms: usize| (held.len() >= terms).then(|| line(held, terms, largest_n)).flatten().map(|(_, last)| last);
    let share = |curve: Value| Value { value: curve.value / factor.value, sigma: curve.sigma / factor.value };
    Ok(Scale { factor, offset_n: last(2), curve: last(3).map(share) })
}

/// Fit with the first terms of factor, offset and curve: the factor and the last term.
fn line(held: &[Held], terms: usize, largest_n: f64) -> Option<(Value, Value)> {
    let residuals = |x: &DVector<f64>| {
        DVector::from_iterator(
            held.len(),
            held.iter().map(|Held { shown_n, read_n }| {
                let by = [*read_n, 1.0, read_n * read_n / largest_n];
                let model: f64 = x.iter().zip(by).map(|(x, by)| x * by).sum();
                (model - shown_n) / SHOWN_N.hypot(HELD_PART * shown_n)
            }),
        )
    };
    let start = [1.0, 0.0, 0.0];
    let Fit { unknowns, covariance, cost } = minimise(&start[..terms], &[1e-4; 3][..terms], residuals)?;
    let scale2 = (cost / held.len().saturating_sub(terms).max(1) as f64).max(1.0);
    let value = |at: usize| Value { value: unknowns[at], sigma: (scale2 * covariance[(at, at)]).sqrt() };
    Some((value(0), value(terms - 1)))
}
