//! A cylinder in place of the plane, its axis along the rows' direction or turned.

use super::{Shape, round};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "cylinder",
    family: Family::Contact,
    about: "A cylinder in place of the plane, its axis along the rows' direction or turned.",
    equations: &["h = -(R - sqrt(R^2 - s^2)), s the distance from the axis; nothing beyond R"],
    state: "none",
    reference: "the compression of Park, Kim, Hirai 2003, eq. 13, with the surface's height added: dL = sqrt(a^2 - r^2) - (a - d) + h",
    keys: &[
        Key::number("curvature_per_mm", "1 / R; 0 is a plane.", 0.0, 1.0, 0.1),
        Key::number("axis_deg", "The axis against the direction along the columns.", -180.0, 180.0, 90.0),
    ],
    zero: &[("curvature_per_mm", 0.0)],
    build: |build: &Build| {
        let angle = build.values.number("axis_deg") * (core::f64::consts::PI / 180.0);
        let across = [-libm::sin(angle), libm::cos(angle)];
        Part::Shape(Box::new(Cylinder { per_mm: build.values.number("curvature_per_mm"), across }))
    },
};

struct Cylinder {
    per_mm: f64,
    across: [f64; 2],
}

impl Shape for Cylinder {
    fn height_mm(&self, x_mm: f64, y_mm: f64, _radius_mm: f64) -> f64 {
        let across_mm = self.across[0] * x_mm + self.across[1] * y_mm;
        round(self.per_mm, across_mm * across_mm)
    }

    fn plain(&self) -> bool {
        self.per_mm == 0.0
    }
}
