//! What a characteristic may look like: force F over conductance G.

use crate::squares::{rms, solve};
use serde::Serialize;

/// The curve's term at the largest conductance is at most so many times the line's.
const GROWN: f64 = 8.0;

/// A force in N at a conductance in mS.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// F.
    pub force: f64,
    /// G.
    pub conductance: f64,
}

/// A form of the characteristic. The first two are the firmware's; the others are there to tell whether it lacks one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// F = a G.
    Line,
    /// F = a G (1 + c G) with c not below 0: conductance that grows ever less with force.
    Curve,
    /// F = a G / (1 - b G): a resistance b that stays, R = a / F + b.
    Series,
    /// F = a G^n.
    Power,
    /// F = a G + b G^2 + c G^3.
    Cubic,
}

impl Form {
    /// In the order in which they are shown.
    pub const ALL: [Self; 5] = [Self::Line, Self::Curve, Self::Series, Self::Power, Self::Cubic];

    /// As a formula.
    pub const fn formula(self) -> &'static str {
        match self {
            Self::Line => "a G",
            Self::Curve => "a G (1 + c G)",
            Self::Series => "a G / (1 - b G)",
            Self::Power => "a G^n",
            Self::Cubic => "a G + b G^2 + c G^3",
        }
    }

    /// Whether the firmware has it.
    pub const fn in_firmware(self) -> bool {
        matches!(self, Self::Line | Self::Curve)
    }

    /// Its parameters in the order of the formula, with the least squares of the force; none where the points do not
    /// tell them.
    pub fn fit(self, points: &[Point]) -> Option<Vec<f64>> {
        let each = || points.iter().map(|point| (point.conductance, point.force));
        let largest = points.iter().map(|point| point.conductance).fold(0.0, f64::max);
        match self {
            Self::Line => Some(solve(each().map(|(g, f)| ([g], f)))?.to_vec()),
            Self::Curve => self.search(points, [0.0, GROWN / largest]),
            Self::Cubic => Some(solve(each().map(|(g, f)| ([g, g * g, g * g * g], f)))?.to_vec()),
            Self::Series => self.search(points, [0.0, 0.95 / largest]),
            Self::Power => self.search(points, [0.2, 4.0]),
        }
    }

    /// The second parameter by a search, the first by least squares.
    fn search(self, points: &[Point], [mut low, mut high]: [f64; 2]) -> Option<Vec<f64>> {
        let at = |second: f64| -> Option<(f64, Vec<f64>)> {
            let [first] =
                solve(points.iter().map(|point| ([self.force(&[1.0, second], point.conductance)], point.force)))?;
            let parameters = vec![first, second];
            Some((self.error(&parameters, points), parameters))
        };
        // By thirds: the error has one valley for all that was recorded so far.
        for _ in 0..60 {
            let [left, right] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if at(left)?.0 < at(right)?.0 { high = right } else { low = left }
        }
        // The search comes near an end, not to it.
        let best = [at(low), at(f64::midpoint(low, high)), at(high)].into_iter().flatten();
        best.min_by(|(left, _), (right, _)| left.total_cmp(right)).map(|(_, parameters)| parameters)
    }

    /// The force at a conductance.
    pub fn force(self, parameters: &[f64], conductance: f64) -> f64 {
        let g = conductance;
        match (self, parameters) {
            (Self::Line, [a]) => a * g,
            (Self::Curve, [a, c]) => a * g * (1.0 + c * g),
            (Self::Series, [a, b]) => a * g / (1.0 - b * g).max(0.01),
            (Self::Power, [a, n]) => a * g.max(0.0).powf(*n),
            (Self::Cubic, [a, b, c]) => a * g + b * g * g + c * g * g * g,
            _ => f64::NAN,
        }
    }

    /// Root mean square of the force's error.
    pub fn error(self, parameters: &[f64], points: &[Point]) -> f64 {
        rms(points.iter().map(|point| self.force(parameters, point.conductance) - point.force))
    }
}
