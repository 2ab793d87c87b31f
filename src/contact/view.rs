//! The picture in shares of its highest taxel: 2^14 is the peak, so products fit 32 bits whatever the load.

use super::arith::{high, reciprocal};
use crate::config::geometry::Geometry;
use crate::pressure::{CODE_BITS, Picture};

/// Fractional bits of a pressure as a share of the peak.
pub const PEAK_BITS: u32 = 14;
/// The lowest peak that is looked at: one code.
const PEAK_MIN: i32 = 1 << CODE_BITS;
/// The highest peak that the converter, the sag and the gain can make.
const PEAK_MAX: i32 = 1 << 18;
/// Y over the peak at most: 512. Below that indentation of a / 512 the model says nothing that the sum does not.
const MODULUS_MAX: u32 = 1 << (PEAK_BITS + 9);
/// Y over the peak at least: beyond, the tip would be pressed flat.
const MODULUS_MIN: u32 = 1 << (PEAK_BITS - 1);

/// A picture and its scale.
pub struct View<'a, const ROWS: usize, const COLUMNS: usize> {
    /// The picture.
    pub picture: &'a Picture<ROWS, COLUMNS>,
    /// By its peak.
    pub scale: Scale,
}

/// What makes a taxel a share of the peak.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// 2^34 over the peak.
    inverse_peak: i32,
    /// Y in shares of the peak, Q14.
    pub modulus: i32,
    /// Puts the modulus' top bit at 30.
    pub modulus_shift: u32,
    /// 2^(62 - modulus_shift) over the modulus.
    pub inverse_modulus: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> View<'_, ROWS, COLUMNS> {
    /// A taxel as a share of the peak, Q14; a taxel of less than -2^18 has no meaning.
    #[inline(always)]
    pub fn share(&self, taxel: i32) -> i32 {
        self.scale.share(taxel)
    }
}

impl Scale {
    /// Of nothing.
    pub const NONE: Self = Self { inverse_peak: 0, modulus: 0, modulus_shift: 0, inverse_modulus: 0 };

    /// In shares of this peak; None where it is too low for the model.
    pub fn new(peak: i32, geometry: &Geometry) -> Option<Self> {
        if peak < PEAK_MIN {
            return None;
        }
        let divisor = peak.min(PEAK_MAX).unsigned_abs();
        let (whole, rest) = (geometry.modulus_q8 / divisor, geometry.modulus_q8 % divisor);
        if whole >= MODULUS_MAX >> (PEAK_BITS - 8) {
            return None;
        }
        let modulus = ((whole << (PEAK_BITS - 8)) + (rest << (PEAK_BITS - 8)) / divisor).max(MODULUS_MIN);
        let modulus_shift = modulus.leading_zeros() - 1;
        Some(Self {
            inverse_peak: (reciprocal(divisor << divisor.leading_zeros()) >> (29 - divisor.leading_zeros())) as i32,
            modulus: modulus as i32,
            modulus_shift,
            inverse_modulus: reciprocal(modulus << (modulus_shift + 1)),
        })
    }

    #[inline(always)]
    fn share(&self, taxel: i32) -> i32 {
        high(taxel << (PEAK_BITS - 2), self.inverse_peak)
    }

    /// The square of what the converter's steps do to a share: a third of a code's square.
    pub fn converter_square(&self) -> u32 {
        let code = self.share(1 << CODE_BITS).unsigned_abs();
        code * code / 3
    }
}
