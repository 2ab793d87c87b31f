//! The shape of the deformed tip: equations 1, 15 and 16.
//!
//! A point of the contact is named by its distance `r` from the contact's centre.

use super::Tip;
use super::arith::{root, square};
use crate::units::Millimetres;

impl Tip {
    /// Height of the undeformed surface over the hemisphere's base at `r`: `z = sqrt(a^2 - r^2)` (eq. 1).
    ///
    /// It is also the free length of the column at `r`, `L` (eq. 15). Correctly rounded. `r` counts as within -a to a.
    pub fn particle_length(&self, r: Millimetres) -> Millimetres {
        Millimetres::from_bits(root(square(self.radius_bits()) - square(self.distance(r))) as i32)
    }

    /// How far the column at `r` is compressed: `dL = sqrt(a^2 - r^2) - (a - d)` inside the contact, 0 outside (eq. 16;
    /// the length QC of eq. 4).
    ///
    /// Correctly rounded: both terms are multiples of the unit, and the root is the nearest one.
    pub fn compression(&self, r: Millimetres, d: Millimetres) -> Millimetres {
        let length = self.particle_length(r).to_bits();
        Millimetres::from_bits((length - self.rest(self.depth(d)) as i32).max(0))
    }

    /// The radius in units of the last place.
    pub(super) const fn radius_bits(&self) -> u32 {
        self.radius().to_bits().unsigned_abs()
    }

    /// What is left between plane and centre, `a - d`, in units of the last place.
    pub(super) const fn rest(&self, depth: u32) -> u32 {
        self.radius_bits() - depth
    }

    /// A distance from the contact's centre, at most a, in units of the last place.
    pub(super) fn distance(&self, r: Millimetres) -> u32 {
        r.to_bits().unsigned_abs().min(self.radius_bits())
    }
}
