//! Integer arithmetic for the fit: products of 32 by 32 bits, and quotients from one 32-bit division.

/// The upper half of a product.
pub(super) const fn high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// `a` plus the share `share_q31` of the way to `b`.
pub(super) const fn between(a: i32, b: i32, share_q31: i32) -> i32 {
    a + 2 * high(b - a, share_q31)
}

/// 2^63 / n, off by less than 2^-29 of itself. The top bit of n counts as set.
pub(super) const fn reciprocal(n: u32) -> u32 {
    let n = n | 1 << 31;
    let coarse = ((u32::MAX / (n >> 16)) as u64) << 15;
    // One Newton step: x (2 - n x), with n x near 2^31 in the upper half.
    let fine = (coarse * ((1 << 32) - ((coarse * n as u64) >> 32))) >> 31;
    if fine >> 32 == 0 { fine as u32 } else { u32::MAX }
}

/// `numerator * 2^bits / denominator`, as near as 32 bits allow; it stops at the ends of the range. 0 counts as 1 below the
/// line.
pub(super) fn quotient(numerator: i64, denominator: u64, bits: u32) -> i32 {
    let magnitude = numerator.unsigned_abs();
    if magnitude == 0 {
        return 0;
    }
    let denominator = denominator | u64::from(denominator == 0);
    let (up, down) = (magnitude.leading_zeros(), denominator.leading_zeros());
    let inverse = reciprocal(((denominator << down) >> 32) as u32);
    // Two numbers of 32 bits, top bits set: their product's upper half has its top bit at 30 or 31.
    let product = (((magnitude << up) >> 32) * u64::from(inverse)) >> 32;
    let drop = (31 + up).saturating_sub(down + bits);
    let cut = if drop > 31 { 0 } else { product >> drop };
    let cut = if drop == 0 || cut > 0x7fff_ffff { 0x7fff_ffff } else { cut } as i32;
    if numerator < 0 { -cut } else { cut }
}

/// `value` within `-limit` to `limit`.
pub(super) const fn within(value: i32, limit: i32) -> i32 {
    if value > limit {
        limit
    } else if value < -limit {
        -limit
    } else {
        value
    }
}
