//! Integer arithmetic of the loop: products of 32 by 32 bits, quotients and square roots.
//!
//! [`floor_sqrt`] takes the root of any 64 bits from the FPU's estimate, made exact by corrections in integers. The
//! estimate is single precision: within 2^9 units. Newton's correction, the remainder over twice the root, brings it to
//! within one unit, and a second remainder sets that right. So the result does not depend on the estimate's last bits.
//! The library's `isqrt` divides 64 bits by 64, which a Cortex-M4 does in software; a table and two Newton steps in
//! integers take twice as long as this.

/// Bound of the estimate's error: 1.5 x 2^-24 of at most 2^32, and a unit.
const ESTIMATE_ERROR: u32 = 512;

/// Returns the largest number whose square is not above `x`.
///
/// ```
/// use fingertip::arith::floor_sqrt;
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

/// Returns a quarter of the root, sqrt(x y), too small by less than 7 x 2^-24 of itself and a unit, for a `y` from
/// 2^24; and x times the gain.
#[inline(always)]
pub(crate) fn root_below(x: u32, y: u32, gain: u64) -> (u32, u64) {
    // The estimate is within 2.5 x 2^-24; a factor less 2^-21 of itself puts it below the exact one.
    lanes::root_and_product(x, y - (y >> 21), gain)
}

/// Returns the nearest integer to the root of a square below 2^56, from a quarter of it by [`root_below`].
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

/// Returns n - root^2.
fn remainder(n: u64, root: u32) -> i64 {
    n.wrapping_sub(u64::from(root) * u64::from(root)) as i64
}

/// Returns `a b / 2^shift`, rounded down and limited to 32 bits.
#[inline(always)]
pub(crate) fn product(a: i32, b: i32, shift: u32) -> i32 {
    held_wide((i64::from(a) * i64::from(b)) >> shift)
}

/// Returns `a b / 2^shift`, rounded to nearest and limited to 32 bits.
#[inline(always)]
pub(crate) fn nearest_product(a: i32, b: i32, shift: u32) -> i32 {
    held_wide(nearest(a, b, shift))
}

/// Returns a b / 2^31, rounded to nearest, for a `b` that is not negative: the result fits 32 bits.
#[inline(always)]
pub(crate) fn nearest_share(a: i32, b: i32) -> i32 {
    nearest(a, b, 31) as i32
}

#[inline(always)]
fn nearest(a: i32, b: i32, shift: u32) -> i64 {
    (i64::from(a) * i64::from(b) + (1 << (shift - 1))) >> shift
}

/// Limits a number to `bits` bits with the sign: one instruction.
#[inline(always)]
pub(crate) fn clamp_bits(value: i32, bits: u32) -> i32 {
    let limit = 1 << (bits - 1);
    value.max(-limit).min(limit - 1)
}

/// Limits a number to 32 bits with one comparison, where `clamp` has two of 64 bits.
#[inline(always)]
pub(crate) fn held_wide(value: i64) -> i32 {
    let low = value as i32;
    if i64::from(low) == value { low } else { (value >> 63) as i32 ^ i32::MAX }
}

/// Returns the upper half of a product.
#[inline(always)]
pub const fn high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// Interpolates from `a` to `b` by the share `share_q31`.
#[inline(always)]
pub const fn between(a: i32, b: i32, share_q31: i32) -> i32 {
    a + 2 * high(b - a, share_q31)
}

/// Limits `value` to `-limit` to `limit`.
pub const fn clamp_to(value: i64, limit: i32) -> i32 {
    if value > limit as i64 {
        limit
    } else if value < -(limit as i64) {
        -limit
    } else {
        value as i32
    }
}

/// Returns 2^63 / n, off by less than 2^-29 of itself. The top bit of n counts as set.
pub const fn reciprocal(n: u32) -> u32 {
    let n = n | 1 << 31;
    let coarse = (u32::MAX / (n >> 16)) << 15;
    // One Newton step, x (2 - n x), with n x near 2^31 in the upper half.
    let gap = ((1_u64 << 32) - ((coarse as u64 * n as u64) >> 32)) as u32;
    let fine = (coarse as u64 * gap as u64) >> 31;
    if fine >> 32 == 0 { fine as u32 } else { u32::MAX }
}

/// Divisor of several numbers.
#[derive(Clone, Copy, Debug)]
pub struct Divisor {
    /// 2^62 over the shifted divisor.
    inverse: i32,
    shift: u32,
}

impl Divisor {
    /// Prepares a division by a number above 0; 0 counts as 1.
    pub const fn new(divisor: u64) -> Self {
        let divisor = if divisor == 0 { 1 } else { divisor };
        let shift = divisor.leading_zeros();
        Self { inverse: (reciprocal(((divisor << shift) >> 32) as u32) >> 1) as i32, shift }
    }

    /// Returns `value * 2^bits` over the divisor, limited to 32 bits.
    pub const fn divide(&self, value: i64, bits: u32) -> i32 {
        // Puts the value's top bit at 30.
        let magnitude = value.unsigned_abs();
        if magnitude == 0 {
            return 0;
        }
        let up = magnitude.leading_zeros();
        let product = high(((magnitude << up) >> 33) as i32, self.inverse);
        // value 2^up / 2^33 times 2^62 / (divisor 2^shift / 2^32) over 2^32.
        let drop = 29 + up;
        let keep = self.shift + bits;
        let magnitude = if keep > drop + 1 {
            i32::MAX
        } else if keep >= drop {
            product << (keep - drop)
        } else if drop - keep > 31 {
            0
        } else {
            product >> (drop - keep)
        };
        if value < 0 { -magnitude } else { magnitude }
    }
}

/// Returns the root of a number, off by less than 2^-15 of itself.
pub const fn root(x: u32) -> u32 {
    if x == 0 {
        return 0;
    }
    let shift = x.leading_zeros() & !1;
    let n = x << shift;
    // A chord of the root over 2^30 to 2^32 is off by 6 %, a Newton step by 0.2 %, the next by 2e-6.
    let chord = (n >> 15) / 3 + 0x5555;
    let near = (chord + n / chord) >> 1;
    ((near + n / near) >> 1) >> (shift / 2)
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

    // --- arith
    use super::{clamp_bits, nearest_product, nearest_share, product};

    #[test]
    fn products_are_rounded_and_held() {
        assert_eq!([product(7, 3, 2), product(-7, 3, 2)], [5, -6]);
        assert_eq!([nearest_product(7, 3, 2), nearest_product(-7, 3, 2), nearest_product(6, 1, 2)], [5, -5, 2]);
        for (a, b, held) in [(i32::MAX, i32::MAX, i32::MAX), (i32::MIN, i32::MAX, i32::MIN), (i32::MIN, -1, i32::MAX)] {
            assert_eq!([product(a, b, 0), nearest_product(a, b.saturating_mul(2), 1)], [held; 2]);
        }
        assert_eq!(
            [clamp_bits(i32::MIN, 28), clamp_bits(i32::MAX, 28), clamp_bits(-5, 28)],
            [-1 << 27, (1 << 27) - 1, -5]
        );
        assert_eq!([nearest_share(i32::MIN, i32::MAX), nearest_share(3, 1 << 30)], [-i32::MAX, 2]);
    }
}
