//! The same fits in f64, two passes over all points: the judge of the sums.

use std::f64::consts::PI;

/// Modulus and standard uncertainty in kPa, contact point in mm.
pub struct Fitted {
    pub modulus_kpa: f64,
    pub sigma_kpa: f64,
    pub contact_mm: f64,
}

/// F against d^2 through the origin.
pub fn against_depth(points: &[(f64, f64)]) -> Fitted {
    let n = points.len() as f64;
    let squares: f64 = points.iter().map(|(d, _)| d.powi(4)).sum();
    let slope = points.iter().map(|(d, force)| d * d * force).sum::<f64>() / squares;
    let scatter: f64 = points.iter().map(|(d, force)| (d * d * (force - slope * d * d)).powi(2)).sum();
    let sigma = (scatter * (1.0 + 10.0 / n)).sqrt() / squares;
    Fitted { modulus_kpa: slope / PI * 1e3, sigma_kpa: sigma / PI * 1e3, contact_mm: 0.0 }
}

/// sqrt(F) against travel.
pub fn against_travel(points: &[(f64, f64)]) -> Fitted {
    let n = points.len() as f64;
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / n;
    let mean_y = points.iter().map(|(_, force)| force.sqrt()).sum::<f64>() / n;
    let spread: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let slope = points.iter().map(|(x, force)| (x - mean_x) * (force.sqrt() - mean_y)).sum::<f64>() / spread;
    let residual = |x: f64, force: f64| force.sqrt() - mean_y - slope * (x - mean_x);
    let scatter: f64 = points.iter().map(|(x, force)| ((x - mean_x) * residual(*x, *force)).powi(2)).sum();
    let sigma = (scatter * (1.0 + 8.0 / n)).sqrt() / spread;
    let modulus_kpa = slope * slope / PI * 1e3;
    Fitted { modulus_kpa, sigma_kpa: 2.0 * modulus_kpa * sigma / slope, contact_mm: mean_x - mean_y / slope }
}
