//! The soft fingertip on a rigid plane: Park, Kim and Hirai, "Development of a Soft-fingertip and Its Modeling Based on
//! Force Distribution", ICRA 2003.

use crate::setup::Tip;
use core::f64::consts::PI;

/// The picture of the tip flattened by an indentation d: everything that does not depend on the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flattened {
    modulus_kpa: f64,
    radius2_mm2: f64,
    remaining_mm: f64,
    contact_radius2_mm2: f64,
}

impl Tip {
    /// The deepest indentation for which pressures are defined, as a share of the radius: beyond it lies the bone.
    pub const DEEPEST: f64 = 0.999;

    /// pi Y, so that F = pi Y d^2 (eq. 14), N/mm^2.
    pub fn force_per_mm2(&self) -> f64 {
        PI * self.modulus_kpa * 1e-3
    }

    /// Total normal force of an indentation (eq. 14); 0 without contact.
    pub fn force_n(&self, indentation_mm: f64) -> f64 {
        let d = indentation_mm.max(0.0);
        self.force_per_mm2() * d * d
    }

    /// Indentation of a force, the inverse of [`Tip::force_n`].
    pub fn indentation_mm(&self, force_n: f64) -> f64 {
        (force_n.max(0.0) / self.force_per_mm2()).sqrt()
    }

    /// The tip flattened by an indentation.
    pub fn flattened(&self, indentation_mm: f64) -> Flattened {
        let a = self.radius_mm;
        let d = indentation_mm.clamp(0.0, Self::DEEPEST * a);
        Flattened {
            modulus_kpa: self.modulus_kpa,
            radius2_mm2: a * a,
            remaining_mm: a - d,
            contact_radius2_mm2: d * (2.0 * a - d),
        }
    }
}

impl Flattened {
    /// Square of the contact radius (eq. 5, 6).
    pub fn contact_radius2_mm2(&self) -> f64 {
        self.contact_radius2_mm2
    }

    /// Pressure at a distance from the contact's centre (eq. 13, 15, 16); 0 outside of the contact.
    ///
    /// p = Y dL/L with L = sqrt(a^2 - r^2) and dL = (r_c^2 - r^2) / (L + a - d), which equals L - (a - d) but
    /// cancels nothing at the rim.
    pub fn pressure_kpa(&self, distance2_mm2: f64) -> f64 {
        let inside = self.contact_radius2_mm2 - distance2_mm2;
        if inside <= 0.0 {
            return 0.0;
        }
        let length = (self.radius2_mm2 - distance2_mm2).sqrt();
        self.modulus_kpa * inside / ((length + self.remaining_mm) * length)
    }
}
