//! Young's modulus from a press: the slope of the force against the square of the indentation.
//!
//! The model says `F = pi Y d^2` (eq. 14), so Y is the slope of F against d^2, over pi (figure 11 of the paper). Two
//! fits find it, both with sums that take a point in constant time and forget it: what a batch gives and what a
//! recursion gives is the same number to the bit, in any order of the points.
//!
//! - [`DepthFit`], where the indentation is known: F against d^2, through the origin.
//! - [`TravelFit`], where only the travel x of the tip is known, and not where it touched: sqrt(F) against x, a
//!   straight line `sqrt(pi Y) (x - x_c)` that gives the contact point x_c along with the slope. To first order this is
//!   F against (x - x_c)^2 with the weights 1/(4 F).
//!
//! Both work in shares of the largest values that they are told to expect, so these should be of the size of the
//! points.
//!
//! The uncertainty does not suppose that all points scatter alike: it takes each squared residual by its own lever (a
//! sandwich estimate), so that it is right for noise in proportion to the force too. `docs/identify.md` has the
//! formulas and what was measured.
//!
//! [`Press`] is the mode of the controller that collects the points.

mod fit;
mod press;
mod sums;

pub use fit::{DepthFit, TravelFit};
pub use press::{Press, View as PressView};

use crate::units::{Kilopascals, Millimetres};

/// The least way between the shallowest and the deepest point.
pub const SPAN_MIN: Millimetres = Millimetres::from_bits((1 << 24) * 3 / 10);
/// The least number of points.
pub const POINTS_MIN: u32 = 20;
/// The largest number of points; what comes after is left out.
pub const POINTS_MAX: u32 = 4096;
/// The root of the mean squared residual may be 2.5 % of that of F at most; here the square's inverse.
const RESIDUAL_PART: i64 = 1_600;
/// The same for sqrt(F): 1.25 %.
const ROOT_RESIDUAL_PART: i64 = 6_400;
/// The standard uncertainty may be this small a part of the modulus at most: 5 %.
const SIGMA_PART: i32 = 20;

/// A modulus and how far to trust it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modulus {
    /// Young's modulus.
    pub modulus: Kilopascals,
    /// Its standard uncertainty.
    pub sigma: Kilopascals,
    /// The travel at which the tip touches; 0 where the indentation was known.
    pub contact: Millimetres,
    /// From how many points.
    pub points: u16,
}

/// Why there is no modulus. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Refusal {
    /// The points span less than [`SPAN_MIN`].
    Span = 1,
    /// There are fewer points than [`POINTS_MIN`].
    Points = 2,
    /// The points do not lie on the model's curve.
    Residual = 3,
    /// The points scatter so that the modulus is worse than 5 %.
    Scatter = 4,
    /// The modulus is outside the model's range.
    Range = 5,
    /// A taxel was dead or saturated before the span was large enough: the sum is not the whole force.
    BadTaxels = 6,
    /// The contact reached the array's edge before the span was large enough.
    Edge = 7,
    /// The travel ended without a contact.
    NoContact = 8,
    /// The tip did not move on for a second before the span was large enough.
    Stalled = 9,
    /// Torque went off, a fault stopped the motor or the parameters changed.
    Interrupted = 10,
    /// Torque is off or the array not tared: there is nothing to press with.
    NotReady = 11,
}

/// How a measurement of the modulus stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Identification {
    /// None was asked for since reset.
    #[default]
    None,
    /// It is under way.
    Running,
    /// It gave this.
    Done(Modulus),
    /// It gave nothing.
    Refused(Refusal),
}

impl Identification {
    /// 0 none, 1 running, 2 done, 3 refused. The numbers are stable.
    pub const fn number(&self) -> u8 {
        match self {
            Self::None => 0,
            Self::Running => 1,
            Self::Done(_) => 2,
            Self::Refused(_) => 3,
        }
    }

    /// The result; zeros where there is none.
    pub fn result(&self) -> Modulus {
        if let Self::Done(modulus) = self { *modulus } else { Modulus::default() }
    }

    /// The number of the [`Refusal`]; 0 where it was not refused.
    pub const fn refusal(&self) -> u8 {
        if let Self::Refused(refusal) = self { *refusal as u8 } else { 0 }
    }
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Span => "the points span less than 0.3 mm: press deeper",
            Self::Points => "fewer than 20 points: take more",
            Self::Residual => {
                "the points do not follow F = pi Y d^2: is the object flat and hard, and the array calibrated?"
            }
            Self::Scatter => "the points scatter too much for 5 %: press deeper or take more",
            Self::Range => "the modulus is outside 20 to 2000 kPa: check the calibration of array and encoder",
            Self::BadTaxels => "a taxel is dead or saturated, so the sum is not the whole force",
            Self::Edge => "the contact reaches the array's edge within 0.3 mm: press nearer the middle",
            Self::NoContact => "the travel ended without a contact",
            Self::Stalled => "the tip did not move on for a second",
            Self::Interrupted => "torque went off, a fault stopped the motor or the parameters changed",
            Self::NotReady => "torque is off or the array is not tared",
        })
    }
}

impl core::error::Error for Refusal {}
