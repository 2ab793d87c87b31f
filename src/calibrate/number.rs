//! Numbers of the evaluation: shares and lengths in tip radii, Q30 in 64 bits.

use crate::root::floor_sqrt;

/// Fractional bits.
pub const BITS: u32 = 30;
/// 1.
pub const ONE: i64 = 1 << BITS;
/// What is beyond has no meaning here; below it products and their sums over a series stay within 64 bits.
const MOST: i64 = 2 * ONE - 1;

/// Held to within 2.
pub const fn held(x: i64) -> i64 {
    if x > MOST {
        MOST
    } else if x < -MOST {
        -MOST
    } else {
        x
    }
}

/// x y, of numbers within 2: a product of 32 bits each, which is all that the microcontroller multiplies at once.
#[inline(always)]
pub const fn mul(x: i64, y: i64) -> i64 {
    ((held(x) as i32 as i64) * (held(y) as i32 as i64)) >> BITS
}

/// x / y of a number within 4; held to within 2, and 0 where y is 0.
pub fn div(x: i64, y: i64) -> i64 {
    let x = x.max(-4 * ONE).min(4 * ONE);
    held((x << BITS).checked_div(y).unwrap_or(0))
}

/// The root of a number within 2; 0 of what is below 0.
pub fn root(x: i64) -> i64 {
    i64::from(floor_sqrt(held(x).max(0).unsigned_abs() << BITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_numbers() {
        let number = |x: f64| (x * ONE as f64) as i64;
        let near = |x: i64, y: f64| (x as f64 / ONE as f64 - y).abs() < 4e-9;
        for (x, y) in [(0.3, 0.7), (-1.9, 1.4), (0.001, -0.9), (1.0, 1.0)] {
            assert!(near(mul(number(x), number(y)), x * y) || (x * y).abs() > 2.0);
            assert!(near(div(number(x), number(y)), (x / y).clamp(-2.0, 2.0)), "{x} {y}");
            let exact = number(x).max(0) as f64 / ONE as f64;
            assert!(near(root(number(x)), exact.sqrt()), "{x}");
        }
        assert_eq!(
            (div(ONE, 0), div(i64::MIN, -1), mul(i64::MAX, i64::MAX), root(i64::MAX)),
            (0, MOST, mul(MOST, MOST), root(MOST))
        );
    }
}
