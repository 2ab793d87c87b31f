//! Products of 32 by 32 bits, brought back to 32.

/// `a b / 2^shift`, rounded down and held to 32 bits.
#[inline(always)]
pub(crate) fn product(a: i32, b: i32, shift: u32) -> i32 {
    held_wide((i64::from(a) * i64::from(b)) >> shift)
}

/// `a b / 2^shift`, rounded to nearest and held to 32 bits.
#[inline(always)]
pub(super) fn nearest_product(a: i32, b: i32, shift: u32) -> i32 {
    held_wide(nearest(a, b, shift))
}

/// a b / 2^31, rounded to nearest, for a `b` that is not negative: fits by itself.
#[inline(always)]
pub(super) fn nearest_share(a: i32, b: i32) -> i32 {
    nearest(a, b, 31) as i32
}

#[inline(always)]
fn nearest(a: i32, b: i32, shift: u32) -> i64 {
    (i64::from(a) * i64::from(b) + (1 << (shift - 1))) >> shift
}

/// The upper half of a product.
#[inline(always)]
pub(super) fn high(a: i32, b: i32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> 32) as i32
}

/// Held to so many bits with the sign: one instruction.
#[inline(always)]
pub(super) fn clamp_bits(value: i32, bits: u32) -> i32 {
    let limit = 1 << (bits - 1);
    value.max(-limit).min(limit - 1)
}

/// One comparison where `clamp` has two of 64 bits.
#[inline(always)]
fn held_wide(value: i64) -> i32 {
    let low = value as i32;
    if i64::from(low) == value { low } else { (value >> 63) as i32 ^ i32::MAX }
}

#[cfg(test)]
mod tests {
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
