//! The paper's equations that the loop does not compute, in double precision. [`fingertip::model`] names the paper.
//!
//! Lengths are in mm, areas in mm^2, forces in N, pressures in kPa and angles in rad; `a` is the tip's radius, `d` its
//! indentation. The touching angle `theta` of a point lies at the hemisphere's centre, between the axis and the line to
//! the point; the centre is `a - d` above the plane. Compression counts as positive, the other way round than in the paper's equation 10.

/// Touching angle at the contact's rim: `theta_max = atan(r_c / (a - d))` (eq. 5).
pub fn touching_angle_max(a: f64, d: f64) -> f64 {
    (d * (2.0 * a - d)).sqrt().atan2(a - d)
}

/// Touching angle of the point at `r`: `theta = atan(r / (a - d))` (eq. 2 and 6, solved for the angle).
pub fn touching_angle(a: f64, d: f64, r: f64) -> f64 {
    r.atan2(a - d)
}

/// Distance from the contact's centre at a touching angle: `r = (a - d) tan(theta)` (eq. 2, 6).
pub fn distance_at(a: f64, d: f64, theta: f64) -> f64 {
    (a - d) * theta.tan()
}

/// Height of the undeformed surface at a touching angle: `Q_z = sqrt(a^2 - (a - d)^2 tan^2(theta))` (eq. 3, 15).
pub fn height_at(a: f64, d: f64, theta: f64) -> f64 {
    let r = distance_at(a, d, theta);
    ((a - r) * (a + r)).sqrt()
}

/// The deformation at a touching angle: `QC = Q_z - (a - d)` (eq. 4, 16).
pub fn compression_at(a: f64, d: f64, theta: f64) -> f64 {
    height_at(a, d, theta) - (a - d)
}

/// Slope of the distance over the touching angle: `dr/dtheta = (a - d) / cos^2(theta)` (eq. 7).
pub fn distance_slope(a: f64, d: f64, theta: f64) -> f64 {
    (a - d) / theta.cos().powi(2)
}

/// Area element per dtheta and dphi: `dS = r dr dphi = (a - d)^2 sin(theta) / cos^3(theta) dtheta dphi` (eq. 8).
pub fn area_density(a: f64, d: f64, theta: f64) -> f64 {
    distance_at(a, d, theta) * distance_slope(a, d, theta)
}

/// The stress of a column, `sigma = F/S` (eq. 9), which is also the pressure on it, `P = F/S` (eq. 12). 1 N/mm^2 is
/// 1000 kPa.
pub fn pressure_of(force: f64, area: f64) -> f64 {
    1e3 * force / area
}

/// The compressional strain of a column, `e = dL/L` (eq. 10).
pub fn strain_of(compression: f64, length: f64) -> f64 {
    compression / length
}

/// The force on a column under a pressure, `F = P S` (eq. 13).
pub fn force_on(pressure: f64, area: f64) -> f64 {
    1e-3 * pressure * area
}

/// The force on a column of modulus `y` compressed by `dL` from its length `L`, `F = Y (dL/L) S` (eq. 11, 13).
pub fn particle_force(y: f64, compression: f64, length: f64, area: f64) -> f64 {
    force_on(y * strain_of(compression, length), area)
}
