//! Integer arithmetic for the model: 32 and 64 bits only, except where a [`Gain`] is made.

use crate::root::floor_sqrt;

/// A positive constant with 64 significant bits: `mantissa * 2^-shift`, the top bit of the mantissa set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Gain {
    mantissa: u64,
    shift: u32,
}

impl Gain {
    /// `number * 2^-exponent`, rounded to 64 significant bits.
    ///
    /// `number` has at least 65 and at most 127 bits.
    pub(super) const fn new(number: u128, exponent: u32) -> Self {
        let spare = 64 - number.leading_zeros();
        let rounded = (number >> (spare - 1)).div_ceil(2);
        if rounded >> 64 == 0 {
            Self { mantissa: rounded as u64, shift: exponent - spare }
        } else {
            Self { mantissa: 1 << 63, shift: exponent - spare - 1 }
        }
    }

    /// The product with `x`, rounded to nearest. For gains below 1/2.
    pub(super) const fn round(self, x: u64) -> u64 {
        self.round_short(x, 0)
    }

    /// The same without the last `drop` bits of the product.
    pub(super) const fn round_short(self, x: u64, drop: u32) -> u64 {
        let shift = self.shift - 64 + drop;
        (mul_high(x, self.mantissa) + (1 << shift >> 1)) >> shift
    }

    /// The product with `x`, rounded down. For gains from 1 and products below 2^58.
    pub(super) const fn floor(self, x: u64) -> u64 {
        mul_high(x << (64 - self.shift), self.mantissa)
    }
}

/// The upper half of a product of 64 by 64 bits, by four products of 32 by 32.
pub(super) const fn mul_high(x: u64, y: u64) -> u64 {
    let (x1, x0) = (x >> 32, x & 0xffff_ffff);
    let (y1, y0) = (y >> 32, y & 0xffff_ffff);
    let middle = x1 * y0 + ((x0 * y0) >> 32);
    let other = x0 * y1 + (middle & 0xffff_ffff);
    x1 * y1 + (middle >> 32) + (other >> 32)
}

/// A quotient rounded down; 0 when the denominator is, which no caller's is: so it has no panic to prove absent.
pub(super) const fn quotient(numerator: u64, denominator: u64) -> u64 {
    match numerator.checked_div(denominator) {
        Some(quotient) => quotient,
        None => 0,
    }
}

/// A quotient rounded to nearest.
pub(super) const fn nearest_quotient(numerator: u64, denominator: u64) -> u64 {
    quotient(numerator + denominator / 2, denominator)
}

/// The square of a length in Q24, in Q48.
pub(super) const fn square(x: u32) -> u64 {
    x as u64 * x as u64
}

/// The square root of a Q48 number below 2^62, in Q24, rounded to nearest.
pub(super) fn root(square_q48: u64) -> u32 {
    floor_sqrt(4 * square_q48).div_ceil(2)
}
