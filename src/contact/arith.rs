//! Integer arithmetic for the fit: products of 32 by 32 bits, quotients and roots from 32-bit divisions.

/// The upper half of a product.
#[inline(always)]
pub const fn high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// `a` plus the share `share_q31` of the way to `b`.
#[inline(always)]
pub const fn between(a: i32, b: i32, share_q31: i32) -> i32 {
    a + 2 * high(b - a, share_q31)
}

/// `value` within `-limit` to `limit`.
pub const fn clamp_to(value: i64, limit: i32) -> i32 {
    if value > limit as i64 {
        limit
    } else if value < -(limit as i64) {
        -limit
    } else {
        value as i32
    }
}

/// 2^63 / n, off by less than 2^-29 of itself. The top bit of n counts as set.
pub const fn reciprocal(n: u32) -> u32 {
    let n = n | 1 << 31;
    let coarse = (u32::MAX / (n >> 16)) << 15;
    // One Newton step, x (2 - n x), with n x near 2^31 in the upper half.
    let gap = ((1_u64 << 32) - ((coarse as u64 * n as u64) >> 32)) as u32;
    let fine = (coarse as u64 * gap as u64) >> 31;
    if fine >> 32 == 0 { fine as u32 } else { u32::MAX }
}

/// A divisor of several numbers.
#[derive(Clone, Copy, Debug)]
pub struct Divisor {
    /// 2^62 over the divisor shifted up.
    inverse: i32,
    shift: u32,
}

impl Divisor {
    /// Of a number above 0; 0 counts as 1.
    pub const fn new(divisor: u64) -> Self {
        let divisor = if divisor == 0 { 1 } else { divisor };
        let shift = divisor.leading_zeros();
        Self { inverse: (reciprocal(((divisor << shift) >> 32) as u32) >> 1) as i32, shift }
    }

    /// `value * 2^bits` over the divisor; it stops at the ends of 32 bits.
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

/// The root of a number, off by less than 2^-15 of itself.
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
