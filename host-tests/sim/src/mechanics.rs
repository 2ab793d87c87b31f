//! Mechanics of the fingers and of what they touch.
//!
//! Everything that stores energy returns its mean slope over a step (a discrete gradient), so the energy balance of the
//! step holds to rounding at any length: only friction and the winding remove energy, and none is created.

pub mod contact;
pub(crate) mod finger;
mod normal;
pub mod pressures;
pub mod rotor;
mod shape;

/// exp(-x) for x of 0 or more, from the four operations alone, so that every machine gives the same bits.
///
/// The diagonal Pade approximant of order 3 at x/1024, squared ten times: relative error below 1e-12 up to x = 12,
/// below 1e-11 up to x = 40; 0 above.
pub fn decay(x: f64) -> f64 {
    if x > 40.0 {
        return 0.0;
    }
    let y = x.max(0.0) / 1024.0;
    let (even, odd) = (1.0 + y * y / 10.0, y / 2.0 + y * y * y / 120.0);
    let mut power = (even - odd) / (even + odd);
    for _ in 0..10 {
        power *= power;
    }
    power
}
