//! Number formats in which the same formula is computed.

use super::scalar::{Constants, Tools, root_f32};
use core::ops::{Add, Div, Mul, Sub};
use fixed::types::I16F16;

/// A number format with its root.
pub trait Number:
    Copy + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Square root of the number.
    fn root(self) -> Self;
    /// A small integer.
    fn from_small(n: u16) -> Self;
    /// The tip in it.
    fn constants(tools: &Tools) -> &Constants<Self>;
}

impl Number for f32 {
    #[inline(always)]
    fn root(self) -> Self {
        root_f32(self)
    }

    #[inline(always)]
    fn from_small(n: u16) -> Self {
        n.into()
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.single
    }
}

impl Number for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        libm::sqrt(self)
    }

    #[inline(always)]
    fn from_small(n: u16) -> Self {
        n.into()
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.double
    }
}

impl Number for I16F16 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn from_small(n: u16) -> Self {
        Self::from_bits(i32::from(n) << 16)
    }

    #[inline(always)]
    fn constants(tools: &Tools) -> &Constants<Self> {
        &tools.fixed
    }
}
