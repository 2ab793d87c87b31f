//! Pressure over the contact and what sums it: equations 12 to 16, figure 7.

use crate::arith::floor_sqrt;
use core::num::{NonZeroU16, NonZeroU64};

use super::{Tip, mul_high, nearest_quotient, quotient, root, square};
use crate::units::{Kilopascals, Millimetres, Newtons, NewtonsPerMillimetre, Strain};

/// A quotient below 1: `significand * 2^-shift` with a relative error below 2^-30.
struct Quotient {
    significand: u64,
    shift: u32,
}

impl Quotient {
    const ZERO: Self = Self { significand: 0, shift: 64 };

    /// `numerator / denominator`, where `numerator < denominator < 2^63`.
    fn new(numerator: u64, denominator: u64) -> Self {
        let (up, down) = (numerator.leading_zeros(), denominator.leading_zeros());
        if up >= 64 || down >= 64 {
            return Self::ZERO;
        }
        let divisor = ((denominator << down) >> 31).div_ceil(2);
        Self { significand: quotient(numerator << up, divisor), shift: 32 + up - down }
    }

    /// Value with 31 to 60 fractional bits, rounded down.
    const fn floor(&self, bits: u32) -> u64 {
        if self.shift > bits {
            self.significand >> (self.shift - bits)
        } else {
            self.significand << (bits - self.shift)
        }
    }

    /// The product with `factor` below 2^27, with 4 bits after the point, rounded down.
    const fn scale_q4(&self, factor: u64) -> u64 {
        if self.shift > 63 { 0 } else { (factor * self.significand) >> (self.shift - 4) }
    }
}

impl Tip {
    /// Strain of the column at `r`, compression positive: `e = dL/L` (eq. 10, 15, 16).
    pub fn strain(&self, r: Millimetres, d: Millimetres) -> Strain {
        let strain = self.strain_at_square(square(self.distance(r)), self.depth(d));
        Strain::from_bits(strain.floor(31).div_ceil(2) as i32)
    }

    /// Pressure at a distance `r` from the contact's centre: `p = Y dL/L` (eq. 13, 15, 16); 0 from the rim on.
    ///
    /// With `L = sqrt(a^2 - r^2)`, `dL = L - (a - d)` cancels at the rim and at small `d`. Here `dL/L` is
    /// `(r_c^2 - r^2) / (L^2 + L (a - d))`: the numerator and `L^2` are exact integers, and nothing is subtracted after
    /// a rounding. That is off by less than 0.1 of a unit; where two results remain possible, integers decide between
    /// them. So it is correctly rounded for every input, and non-increasing in `r`.
    pub fn pressure(&self, r: Millimetres, d: Millimetres) -> Kilopascals {
        let (depth, distance_square) = (self.depth(d), square(self.distance(r)));
        let estimate_q4 = self.strain_at_square(distance_square, depth).scale_q4(self.modulus_bits());
        // The exact value is between the estimate less 2/16 and the estimate plus 3/16.
        let (low, high) = ((estimate_q4 + 8 - 2) >> 4, (estimate_q4 + 8 + 3) >> 4);
        let bits = if low < high && self.pressure_reaches(high, distance_square, depth) { high } else { low };
        Kilopascals::from_bits(bits as i32)
    }

    /// Returns true if the pressure comes within half a unit of `bits` from below: `Y (1 - (a - d)/L) >= bits - 1/2`,
    /// cleared of fraction and root.
    fn pressure_reaches(&self, bits: u64, distance_square: u64, depth: u32) -> bool {
        let lost = u128::from(2 * self.modulus_bits() * u64::from(self.rest(depth)));
        let left = u128::from(2 * (self.modulus_bits() - bits) + 1);
        let length_square = u128::from(square(self.radius_bits()) - distance_square);
        lost * lost <= left * left * length_square
    }

    /// Pressure at the contact's centre, `p(0) = Y d / a`. Correctly rounded.
    pub fn peak_pressure(&self, d: Millimetres) -> Kilopascals {
        Kilopascals::from_bits(nearest_quotient(
            self.modulus_bits() * u64::from(self.depth(d)),
            self.radius_bits().into(),
        ) as i32)
    }

    /// Force over contact area, `F / (pi r_c^2) = Y d / (2a - d)`. Correctly rounded.
    pub fn mean_pressure(&self, d: Millimetres) -> Kilopascals {
        let depth = self.depth(d);
        let denominator = u64::from(2 * self.radius_bits() - depth);
        Kilopascals::from_bits(nearest_quotient(self.modulus_bits() * u64::from(depth), denominator) as i32)
    }

    /// Indentation from the pressure at the contact's centre, `d = a p(0) / Y`. Correctly rounded.
    ///
    /// The pressure counts as within 0 to that of [`Tip::depth_max`].
    pub fn indentation_from_peak(&self, peak: Kilopascals) -> Millimetres {
        let peak = peak.max(Kilopascals::ZERO).min(self.modulus()).to_bits().unsigned_abs();
        let bits = nearest_quotient(u64::from(self.radius_bits()) * u64::from(peak), self.modulus_bits());
        Millimetres::from_bits(bits as i32).min(self.depth_max())
    }

    /// Indentation from the contact radius, `d = a - sqrt(a^2 - r_c^2)`. Correctly rounded.
    ///
    /// In floating point this cancels and is written `r_c^2 / (a + sqrt(a^2 - r_c^2))`; here the difference under the
    /// root is exact, the root is the nearest multiple of the unit and a is a multiple of it, so nothing is lost. The
    /// radius counts as within 0 to that of [`Tip::depth_max`].
    pub fn indentation_from_radius(&self, contact_radius: Millimetres) -> Millimetres {
        let distance = self.distance(contact_radius.max(Millimetres::ZERO));
        let length = root(square(self.radius_bits()) - square(distance));
        Millimetres::from_bits((self.radius_bits() - length) as i32).min(self.depth_max())
    }

    /// Stiffness at a total force, `k = 2 sqrt(pi Y F)`.
    ///
    /// `F` counts as within 0 to [`Tip::force_max`].
    pub fn stiffness_at_force(&self, force: Newtons) -> NewtonsPerMillimetre {
        let force_bits = u64::from(force.max(Newtons::ZERO).min(self.force_max()).to_bits().unsigned_abs());
        NewtonsPerMillimetre::from_bits(floor_sqrt(self.square_gain.floor(force_bits)).div_ceil(2) as i32)
    }

    /// Total force by quadrature over rings: `F = integral of p dS` (eq. 14), the integral of which [`Tip::force`]
    /// is the closed form.
    ///
    /// In `u = r^2` the area element is `pi du` and the pressure is smooth up to the rim, so the midpoint rule over
    /// rings of equal area converges with the square of their number.
    pub fn force_by_rings(&self, d: Millimetres, rings: NonZeroU16) -> Newtons {
        let depth = self.depth(d);
        let contact_square = self.contact_square(depth);
        let rings = NonZeroU64::from(rings);
        let halves = rings.saturating_mul(NonZeroU64::MIN.saturating_add(1));
        let (whole, rest) = (contact_square / halves, contact_square % halves);
        let sum_q48: u64 = (0..rings.get())
            .map(|ring| {
                let middle = 2 * ring + 1;
                self.strain_at_square(whole * middle + rest * middle / halves, depth).floor(48)
            })
            .sum();
        self.force_of_area(mul_high(contact_square << 8, (sum_q48 / rings) << 8))
    }

    /// The strain where `r^2` is `square_q48`.
    fn strain_at_square(&self, square_q48: u64, depth: u32) -> Quotient {
        let contact_square = self.contact_square(depth);
        if square_q48 >= contact_square {
            return Quotient::ZERO;
        }
        let length_square = square(self.radius_bits()) - square_q48;
        let spare = length_square.leading_zeros() / 2;
        let length = u64::from(floor_sqrt(length_square << (2 * spare)));
        let cross = (length * u64::from(self.rest(depth))) >> spare;
        Quotient::new(contact_square - square_q48, length_square + cross)
    }

    /// The modulus in units of the last place.
    fn modulus_bits(&self) -> u64 {
        u64::from(self.modulus().to_bits().unsigned_abs())
    }
}
