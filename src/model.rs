//! The soft fingertip's model in fixed point.
//!
//! A hemisphere of radius `a` and Young's modulus `Y` is pressed by `d` (the paper's `d0`) against a rigid plane. Park,
//! Kim and Hirai, "Development of a soft-fingertip and its modeling based on force distribution", ICRA 2003, see it as
//! a bundle of independent columns along the normal; the equation numbers in this module are theirs. `docs/model.md`
//! says how each formula is arranged so that no digits are lost, and how far each result can be off.
//!
//! A [`Tip`] is made once, with a typed error for a radius or a modulus out of range. Everything after that is total:
//! an input outside the domain counts as the nearest one inside.
//!
//! ```
//! use fingertip::model::Tip;
//! use fingertip::units::{Kilopascals, Millimetres};
//!
//! let tip = Tip::new(Millimetres::from_bits(10 << 24), Kilopascals::from_bits(250 << 16)).unwrap();
//! let force = tip.force(Millimetres::from_bits(2 << 24));
//! assert_eq!(force.0.to_string(), "3.14159"); // pi 0.25 N/mm^2 (2 mm)^2
//! assert_eq!(tip.contact_radius(Millimetres::from_bits(2 << 24)), Millimetres::from_bits(6 << 24));
//! ```
//!
//! Functions of a point of the contact name it by its distance `r` from the contact's centre. Arithmetic is of 32 and
//! 64 bits only, except where a `Gain` is made.

mod pressure;

use crate::arith::{floor_sqrt, nearest_root, root_below};
use crate::units::{Kilopascals, Millimetres, Newtons, NewtonsPerMillimetre};

/// The smallest tip radius a.
pub const RADIUS_MIN: Millimetres = Millimetres::from_bits(4 << 24);
/// The largest tip radius a.
pub const RADIUS_MAX: Millimetres = Millimetres::from_bits(16 << 24);
/// The smallest Young's modulus Y.
pub const MODULUS_MIN: Kilopascals = Kilopascals::from_bits(20 << 16);
/// The largest Young's modulus Y.
pub const MODULUS_MAX: Kilopascals = Kilopascals::from_bits(2_000 << 16);

/// pi times 2^98.
const PI_Q98: u128 = 0xc_90fd_aa22_168c_234c_4c66_28b8;
/// 1/pi times 2^110.
const INVERSE_PI_Q110: u128 = 0x145f_306d_c9c8_82a5_3f84_eafa_3ea7;

/// A tip that the model does not cover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TipError {
    /// The radius a is out of [`RADIUS_MIN`] to [`RADIUS_MAX`].
    Radius(Millimetres),
    /// The modulus Y is out of [`MODULUS_MIN`] to [`MODULUS_MAX`].
    Modulus(Kilopascals),
}

impl core::fmt::Display for TipError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Radius(value) => {
                write!(f, "tip radius of {} mm: {} to {} mm are covered", value.0, RADIUS_MIN.0, RADIUS_MAX.0)
            }
            Self::Modulus(value) => {
                write!(f, "Young's modulus of {} kPa: {} to {} kPa are covered", value.0, MODULUS_MIN.0, MODULUS_MAX.0)
            }
        }
    }
}

impl core::error::Error for TipError {}

/// A fingertip: its radius and modulus, and the constants that follow from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tip {
    radius: Millimetres,
    modulus: Kilopascals,
    depth_max: Millimetres,
    force_max: Newtons,
    /// The indentation at `force_max`; past `depth_max` by the rounding of that at most, and cut to it.
    deepest: Millimetres,
    /// Newtons from a squared length in Q48: pi Y.
    force_gain: Gain,
    /// A sixteenth of the squared length in Q48 from newtons, Q32: 1/(16 pi Y).
    area_gain_q32: u64,
    /// Newtons a millimetre from millimetres: 2 pi Y.
    stiffness_gain: Gain,
    /// Four times the squared stiffness from newtons: 16 pi Y.
    square_gain: Gain,
}

impl Tip {
    /// A tip of the given radius a and Young's modulus Y.
    ///
    /// All division and all arithmetic beyond 64 bits happens here.
    ///
    /// # Errors
    /// The radius or the modulus is out of its range; the error holds the value and prints the range.
    pub fn new(radius: Millimetres, modulus: Kilopascals) -> Result<Self, TipError> {
        if radius < RADIUS_MIN || radius > RADIUS_MAX {
            return Err(TipError::Radius(radius));
        }
        if modulus < MODULUS_MIN || modulus > MODULUS_MAX {
            return Err(TipError::Modulus(modulus));
        }
        let modulus_bits = u128::from(modulus.to_bits().unsigned_abs());
        // 1 kPa is 1/1000 N/mm^2. The modulus counts 2^-16 kPa and a squared length 2^-48 mm^2; force, modulus and
        // stiffness have the same 16 bits after the point, which cancel.
        let pi_y_q98 = (PI_Q98 * modulus_bits + 500) / 1000;
        let inverse_pi_y_q110 = (INVERSE_PI_Q110 * 1000 + modulus_bits / 2) / modulus_bits;
        let depth_max_bits = (i64::from(radius.to_bits()) * 19 + 19) / 20;
        let mut tip = Self {
            radius,
            modulus,
            depth_max: Millimetres::from_bits(depth_max_bits as i32),
            force_max: Newtons::ZERO,
            deepest: Millimetres::ZERO,
            force_gain: Gain::new(pi_y_q98, 98 + 48),
            area_gain_q32: (inverse_pi_y_q110 >> (110 - 48 + 4 - 32 - 1)).div_ceil(2) as u64,
            stiffness_gain: Gain::new(pi_y_q98, 98 + 24 - 1),
            square_gain: Gain::new(pi_y_q98, 98 - 4),
        };
        tip.force_max = tip.force(tip.depth_max);
        tip.deepest = tip.indentation_within(tip.force_max).min(tip.depth_max);
        Ok(tip)
    }

    /// The radius a.
    pub const fn radius(&self) -> Millimetres {
        self.radius
    }

    /// Young's modulus Y.
    pub const fn modulus(&self) -> Kilopascals {
        self.modulus
    }

    /// The deepest indentation that the model covers: 0.95 a, rounded up to a representable length.
    pub const fn depth_max(&self) -> Millimetres {
        self.depth_max
    }

    /// The force at [`Tip::depth_max`].
    pub const fn force_max(&self) -> Newtons {
        self.force_max
    }

    /// Total force at an indentation, `F = pi Y d^2` (eq. 14).
    ///
    /// Non-decreasing in `d`. `d` counts as within 0 to [`Tip::depth_max`].
    pub fn force(&self, d: Millimetres) -> Newtons {
        self.force_of_area(square(self.depth(d)))
    }

    /// Indentation at a total force, `d = sqrt(F/(pi Y))`.
    ///
    /// Non-decreasing in `F`, which counts as within 0 to [`Tip::force_max`]. The slope is infinite at 0: one unit of
    /// force there is `sqrt(2^-16 N / (pi Y))`, 4.4 um for Y = 250 kPa, and no unit of force anywhere moves `d` by
    /// more.
    #[inline(always)]
    pub fn indentation(&self, force: Newtons) -> Millimetres {
        if force >= self.force_max {
            return self.deepest;
        }
        self.indentation_within(force)
    }

    /// [`Tip::indentation`] of a force within the domain.
    #[inline(always)]
    fn indentation_within(&self, force: Newtons) -> Millimetres {
        let force_bits = force.max(Newtons::ZERO).to_bits().cast_unsigned();
        let gain = self.area_gain_q32;
        let (quarter, sixteenth_q32) = root_below(force_bits, (gain >> 32) as u32, gain);
        let root = nearest_root(quarter, (sixteenth_q32 >> 32) as u32, (sixteenth_q32 >> 26) as u32);
        Millimetres::from_bits(root.cast_signed())
    }

    /// Radius of the contact, `r_c = sqrt(d (2a - d))` (eq. 5, 6).
    ///
    /// Correctly rounded for every input. `d` counts as within 0 to [`Tip::depth_max`].
    #[inline(always)]
    pub fn contact_radius(&self, d: Millimetres) -> Millimetres {
        let depth = self.depth(d);
        let other = 2 * self.radius.to_bits().cast_unsigned() - depth;
        let (root, square) = root_below(depth, other, other.into());
        Millimetres::from_bits(nearest_root(root >> 2, (square >> 4) as u32, (square << 2) as u32).cast_signed())
    }

    /// Stiffness at an indentation, `k = dF/dd = 2 pi Y d`.
    ///
    /// `d` counts as within 0 to [`Tip::depth_max`].
    pub fn stiffness(&self, d: Millimetres) -> NewtonsPerMillimetre {
        NewtonsPerMillimetre::from_bits(self.stiffness_gain.round(u64::from(self.depth(d))) as i32)
    }

    /// `pi Y` times a number with 48 bits after the point, rounded once, to nearest.
    ///
    /// A squared length in mm^2 gives a force in N, a cubed length in mm^3 a moment in N mm. The result has `16 - drop`
    /// bits after the point. The number counts as at most 2^15, `drop` as at most 16.
    pub fn pi_y_times(&self, number_q48: u64, drop: u32) -> u64 {
        self.force_gain.round_short(number_q48.min(1 << 63), drop.min(16))
    }

    /// `pi Y` times a squared length in Q48.
    fn force_of_area(&self, square_q48: u64) -> Newtons {
        Newtons::from_bits(self.force_gain.round(square_q48) as i32)
    }

    /// The indentation within its domain, in units of the last place.
    fn depth(&self, d: Millimetres) -> u32 {
        d.max(Millimetres::ZERO).min(self.depth_max).to_bits().cast_unsigned()
    }

    /// `r_c^2 = d (2a - d)` in Q48, exact.
    fn contact_square(&self, depth: u32) -> u64 {
        u64::from(depth) * u64::from(2 * self.radius.to_bits().unsigned_abs() - depth)
    }
}

impl Tip {
    /// Height of the undeformed surface over the hemisphere's base at `r`: `z = sqrt(a^2 - r^2)` (eq. 1).
    ///
    /// It is also the free length of the column at `r`, `L` (eq. 15). Correctly rounded. `r` counts as within -a to a.
    pub fn particle_length(&self, r: Millimetres) -> Millimetres {
        Millimetres::from_bits(root(square(self.radius_bits()) - square(self.distance(r))) as i32)
    }

    /// Compression of the column at `r`: `dL = sqrt(a^2 - r^2) - (a - d)` inside the contact, 0 outside (eq. 16; the
    /// length QC of eq. 4).
    ///
    /// Correctly rounded: both terms are multiples of the unit, and the root is the nearest one.
    pub fn compression(&self, r: Millimetres, d: Millimetres) -> Millimetres {
        let length = self.particle_length(r).to_bits();
        Millimetres::from_bits((length - self.rest(self.depth(d)) as i32).max(0))
    }

    /// The radius in units of the last place.
    const fn radius_bits(&self) -> u32 {
        self.radius().to_bits().unsigned_abs()
    }

    /// Distance between plane and centre, `a - d`, in units of the last place.
    const fn rest(&self, depth: u32) -> u32 {
        self.radius_bits() - depth
    }

    /// A distance from the contact's centre, at most a, in units of the last place.
    fn distance(&self, r: Millimetres) -> u32 {
        r.to_bits().unsigned_abs().min(self.radius_bits())
    }
}

/// A positive constant with 64 significant bits: `mantissa * 2^-shift`, the top bit of the mantissa set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Gain {
    mantissa: u64,
    shift: u32,
}

impl Gain {
    /// `number * 2^-exponent`, rounded to 64 significant bits.
    ///
    /// `number` has at least 65 and at most 127 bits.
    const fn new(number: u128, exponent: u32) -> Self {
        let spare = 64 - number.leading_zeros();
        let rounded = (number >> (spare - 1)).div_ceil(2);
        if rounded >> 64 == 0 {
            Self { mantissa: rounded as u64, shift: exponent - spare }
        } else {
            Self { mantissa: 1 << 63, shift: exponent - spare - 1 }
        }
    }

    /// The product with `x`, rounded to nearest. For gains below 1/2.
    const fn round(self, x: u64) -> u64 {
        self.round_short(x, 0)
    }

    /// The same without the last `drop` bits of the product.
    const fn round_short(self, x: u64, drop: u32) -> u64 {
        let shift = self.shift - 64 + drop;
        (mul_high(x, self.mantissa) + (1 << shift >> 1)) >> shift
    }

    /// The product with `x`, rounded down. For gains from 1 and products below 2^58.
    const fn floor(self, x: u64) -> u64 {
        mul_high(x << (64 - self.shift), self.mantissa)
    }
}

/// The upper half of a product of 64 by 64 bits, by four products of 32 by 32.
const fn mul_high(x: u64, y: u64) -> u64 {
    let (x1, x0) = (x >> 32, x & 0xffff_ffff);
    let (y1, y0) = (y >> 32, y & 0xffff_ffff);
    let middle = x1 * y0 + ((x0 * y0) >> 32);
    let other = x0 * y1 + (middle & 0xffff_ffff);
    x1 * y1 + (middle >> 32) + (other >> 32)
}

/// Quotient, rounded down. A denominator of 0, which no caller passes, gives 0 instead of a panic.
const fn quotient(numerator: u64, denominator: u64) -> u64 {
    match numerator.checked_div(denominator) {
        Some(quotient) => quotient,
        None => 0,
    }
}

/// A quotient rounded to nearest.
const fn nearest_quotient(numerator: u64, denominator: u64) -> u64 {
    quotient(numerator + denominator / 2, denominator)
}

/// The square of a length in Q24, in Q48.
const fn square(x: u32) -> u64 {
    x as u64 * x as u64
}

/// The square root of a Q48 number below 2^62, in Q24, rounded to nearest.
fn root(square_q48: u64) -> u32 {
    floor_sqrt(4 * square_q48).div_ceil(2)
}
