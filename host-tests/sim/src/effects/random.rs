//! Random numbers that are the same on every machine.

use fastrand::Rng;

/// A number of the normal distribution, mean 0 and deviation 1: Marsaglia's polar method. The logarithm is libm's own,
/// in plain Rust.
pub fn normal(rng: &mut Rng) -> f64 {
    loop {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * libm::log(s) / s).sqrt();
        }
    }
}

/// So many of them, to the bit what [`normal`] gives one after the other, but quicker: no draw that is thrown away is
/// waited for.
pub fn normals<const COUNT: usize>(rng: &mut Rng) -> [f64; COUNT] {
    let (mut first, mut squares) = ([0.0; COUNT], [0.0; COUNT]);
    let mut drawn = 0;
    while drawn < COUNT {
        let (u, v) = (2.0 * rng.f64() - 1.0, 2.0 * rng.f64() - 1.0);
        let s = u * u + v * v;
        (first[drawn], squares[drawn]) = (u, s);
        drawn += usize::from((s > 0.0) & (s < 1.0));
    }
    for (u, s) in first.iter_mut().zip(squares) {
        *u *= (-2.0 * libm::log(s) / s).sqrt();
    }
    first
}

/// One of [`normal`], drawn again beyond three deviations: for what a part is made with, since worse parts are thrown
/// away.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_normal_numbers_are_those_drawn_one_by_one() {
        let (mut one_by_one, mut at_once) = (Rng::with_seed(5), Rng::with_seed(5));
        for _ in 0..100_000 {
            let expected: [u64; 10] = core::array::from_fn(|_| normal(&mut one_by_one).to_bits());
            assert_eq!(normals::<10>(&mut at_once).map(f64::to_bits), expected);
        }
        assert_eq!(one_by_one.u64(..), at_once.u64(..));
    }
}
