//! The square root of the loop: exact, 64 to 32 bits, without division and without floating point.
//!
//! A table of 192 bytes gives 1/sqrt(n) to 7 bits; a Newton step makes that 14 and another makes the root 28; the
//! remainder sets the last bits right. All products are 32 by 32 bits. The library's `isqrt` divides 64 bits by
//! 64, which a Cortex-M4 does in software.

/// 256 / sqrt((i + 64.5) / 256) - 256, rounded.
const SEEDS: [u8; 192] = {
    let mut seeds = [0; 192];
    let mut i = 0;
    while i < 192 {
        // The value plus 256 is the root of 2^25 / (2 i + 129); four times the square gives the bit to round with.
        let twice = ((1u64 << 27) / (2 * i as u64 + 129)).isqrt() as u32;
        let rounded = twice.div_ceil(2);
        seeds[i] = if rounded < 512 { (rounded - 256) as u8 } else { u8::MAX };
        i += 1;
    }
    seeds
};

/// The largest number whose square is not above `x`.
///
/// ```
/// use fingertip::root::floor_sqrt;
/// assert_eq!([floor_sqrt(0), floor_sqrt(99), floor_sqrt(100), floor_sqrt(u64::MAX)], [0, 9, 10, u32::MAX]);
/// ```
pub const fn floor_sqrt(x: u64) -> u32 {
    if x == 0 {
        return 0;
    }
    // An even shift puts the number into [2^62, 2^64), and halves itself on the root.
    let shift = x.leading_zeros() & !1;
    let n = x << shift;
    let top = (n >> 32) as u32;
    let place = (top >> 24) as usize;
    let seed = if place >= 64 && place < 256 { SEEDS[place - 64] } else { 0 };

    // y is 1/sqrt in Q30, s the root in Q30, gap how far y s is from 1.
    let y = (256 + seed as u32) << 22;
    let s = high(top, y);
    let gap = gap(s, y);
    let y = add(y, (y as i64 * gap as i64) >> 31);
    let s = high(top, y);
    let s = add(s, (s as i64 * self::gap(s, y) as i64) >> 31) as i64;

    // The remainder n - root^2, as far as the root is wrong, fits 64 bits with its sign; times y / 2 it is the correction.
    let root = s << 2;
    let rest = n.wrapping_sub((root as u64).wrapping_mul(root as u64)) as i64;
    let root = root + (((rest >> 8) * y as i64) >> 55);
    let rest = n.wrapping_sub((root as u64).wrapping_mul(root as u64)) as i64;
    let root = if rest < 0 {
        root - 1
    } else if rest > 2 * root {
        root + 1
    } else {
        root
    };
    (root >> (shift / 2)) as u32
}

/// The upper half of a product.
const fn high(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

/// 1 - s y in Q30.
const fn gap(s: u32, y: u32) -> i32 {
    (1 << 30) - ((s as u64 * y as u64) >> 30) as i32
}

const fn add(a: u32, b: i64) -> u32 {
    a.wrapping_add(b as u32)
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
