//! Numbers of the evaluation: shares and lengths in tip radii, Q30 in 64 bits.

use crate::contact::parts::Divisor;
use crate::root::floor_sqrt;

/// Fractional bits.
pub const BITS: u32 = 30;
/// 1.
pub const ONE: i64 = 1 << BITS;
/// What is beyond has no meaning here; below it products and their sums over a series stay within 64 bits.
const MOST: i64 = 2 * ONE - 1;

/// Clamped to within 2.
pub const fn clamped(x: i64) -> i64 {
    if x > MOST {
        MOST
    } else if x < -MOST {
        -MOST
    } else {
        x
    }
}

/// x y, of numbers within 2: a product of 32 bits each, which is all that the microcontroller multiplies at once. Beyond
/// it is no number, and nothing worse.
#[inline(always)]
pub const fn mul(x: i64, y: i64) -> i64 {
    ((x as i32 as i64) * (y as i32 as i64)) >> BITS
}

/// x / y, to 2^-28 of itself; clamped to within 2, and 0 where y is 0.
pub fn div(x: i64, y: i64) -> i64 {
    if y == 0 {
        return 0;
    }
    // A bit less than there is room for: near to 1 the divisor stops before its end.
    let quotient = clamped(i64::from(Divisor::new(y.unsigned_abs()).divide(x, BITS - 1)) << 1);
    if y < 0 { -quotient } else { quotient }
}

/// The mean of so many numbers.
pub fn mean(sum: i64, count: i64) -> i64 {
    Divisor::new(count.unsigned_abs()).divide(sum, 0).into()
}

/// The root of a number within 2; 0 of what is below 0.
pub fn root(x: i64) -> i64 {
    i64::from(floor_sqrt(clamped(x).max(0).unsigned_abs() << BITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_numbers() {
        let number = |x: f64| (x * ONE as f64) as i64;
        let near = |x: i64, y: f64| (x as f64 / ONE as f64 - y).abs() < 1.5e-8;
        for (x, y) in [(0.3, 0.7), (-1.9, 1.4), (0.001, -0.9), (1.0, 1.0), (1.0, 0.998), (0.9, 0.46), (-1.9, -0.96)] {
            assert!(near(mul(number(x), number(y)), x * y) || (x * y).abs() > 2.0);
            assert!(near(div(number(x), number(y)), (x / y).clamp(-2.0, 2.0)), "{x} {y}");
            let exact = number(x).max(0) as f64 / ONE as f64;
            assert!(near(root(number(x)), exact.sqrt()), "{x}");
        }
        assert_eq!((div(ONE, 0), div(i64::MIN, -1), div(ONE, -1), root(i64::MAX)), (0, MOST, -MOST, root(MOST)));
    }
}
