//! The square roots of the loop: by the FPU's estimate, made exact by corrections in integers.
//!
//! [`floor_sqrt`] takes any 64 bits. The estimate is single precision: within 2^9 units. Newton's correction, the
//! remainder over twice the root, brings it to within one unit, and a second remainder sets that right. So the result
//! is the same whatever the estimate's last bits are. The library's `isqrt` divides 64 bits by 64, which a Cortex-M4
//! does in software; a table and two Newton steps in integers take twice as long as this.

/// More than the estimate can be wrong by: 1.5 x 2^-24 of at most 2^32, and a unit.
const ESTIMATE_ERROR: u32 = 512;

/// The largest number whose square is not above `x`.
///
/// ```
/// use fingertip::root::floor_sqrt;
/// assert_eq!([floor_sqrt(0), floor_sqrt(99), floor_sqrt(100), floor_sqrt(u64::MAX)], [0, 9, 10, u32::MAX]);
/// ```
pub fn floor_sqrt(x: u64) -> u32 {
    if x == 0 {
        return 0;
    }
    // An even shift puts the number into [2^62, 2^64), and halves itself on the root.
    let shift = x.leading_zeros() & !1;
    let n = x << shift;
    // From below, so that the remainder is positive: below 2^43, so its quotient by 2^11 fits 32 bits.
    let near = lanes::near_root((n >> 32) as u32).wrapping_sub(ESTIMATE_ERROR);
    let root = near.wrapping_add((remainder(n, near) >> 11) as u32 / (near >> 10 | 1));
    // A root of 2^32 has wrapped to 0, and wraps back.
    let rest = remainder(n, root);
    let root = if rest < 0 {
        root.wrapping_sub(1)
    } else if rest > 2 * i64::from(root) {
        root.wrapping_add(1)
    } else {
        root
    };
    root >> (shift / 2)
}

/// A quarter of the root, sqrt(x y), too small by less than 7 x 2^-24 of itself and a unit, for a `y` from 2^24; and x
/// times the gain.
#[inline(always)]
pub(crate) fn root_below(x: u32, y: u32, gain: u64) -> (u32, u64) {
    // The estimate is within 2.5 x 2^-24; a factor less 2^-21 of itself puts it below the exact one.
    lanes::root_and_product(x, y - (y >> 21), gain)
}

/// The nearest integer to the root of a square below 2^56, from a quarter of it by [`root_below`].
///
/// `sixteenth` is the square without its last four bits, `fourfold` four times the square, both rounded down and modulo
/// 2^32: remainders fit 32 bits, so only the last bits of squares are computed. That makes it twice as quick as
/// [`floor_sqrt`].
#[inline(always)]
pub(crate) fn nearest_root(quarter: u32, sixteenth: u32, fourfold: u32) -> u32 {
    // The quarter is too small by less than 28, so the remainder is positive and below 2^32.
    let rest = sixteenth.wrapping_sub(quarter.wrapping_mul(quarter));
    // Twice the remainder over the quarter: right to a small part of a unit, then rounded down.
    let near = 4 * quarter + rest / (quarter >> 1 | 1);
    // So it is the nearest integer or the one below: the next one is nearer where four squares are above (2 near +
    // 1)^2.
    let beyond = near.wrapping_mul(near + 1).wrapping_mul(4).wrapping_sub(fourfold);
    near + (beyond >> 31)
}

/// n - root^2.
fn remainder(n: u64, root: u32) -> i64 {
    n.wrapping_sub(u64::from(root) * u64::from(root)) as i64
}

#[cfg(test)]
mod tests {
    use super::floor_sqrt;

    fn check(x: u64) {
        assert_eq!(u64::from(floor_sqrt(x)), x.isqrt(), "{x}");
    }

    #[test]
    fn right_around_every_power_of_two_and_every_seed() {
        for bit in 0..64 {
            for near in -2..=2 {
                check((1u64 << bit).wrapping_add_signed(near));
            }
        }
        for seed in 64..256u64 {
            for shift in 0..=56 {
                for near in -3..=3 {
                    check((seed << shift).wrapping_add_signed(near));
                    check(((seed << 1 | 1) << shift >> 1).wrapping_add_signed(near));
                }
            }
        }
    }

    #[test]
    fn right_around_squares() {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let root = state >> 32 >> (state & 31);
            let square = root * root;
            for near in [square.wrapping_sub(1), square, square + 1, square + 2 * root] {
                check(near);
            }
            check(state >> (state & 63));
        }
    }
}
