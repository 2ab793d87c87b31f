//! Random numbers that are the same on every machine.

use fastrand::Rng;

/// A number of the normal distribution, mean 0 and deviation 1: Marsaglia's polar method. The logarithm is libm's own, in plain Rust.
pub fn normal(rng: &mut Rng) -> f64 {
    loop {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * libm::log(s) / s).sqrt();
        }
    }
}

/// The same, drawn again beyond three deviations: for what a part is made with, since worse parts are thrown away.
pub fn normal_within_3(rng: &mut Rng) -> f64 {
    loop {
        let draw = normal(rng);
        if draw.abs() <= 3.0 {
            return draw;
        }
    }
}

/// A waiting time of a Poisson process; infinite at rate 0.
pub fn waiting_s(rng: &mut Rng, rate_per_s: f64) -> f64 {
    -libm::log(1.0 - rng.f64()) / rate_per_s
}
