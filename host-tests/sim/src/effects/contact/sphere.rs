//! A ball in place of the plane.

use super::{Shape, round};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "sphere",
    family: Family::Contact,
    about: "A ball in place of the plane.",
    equations: &["h = -(R - sqrt(R^2 - r^2)); nothing beyond R"],
    state: "none",
    reference: "the compression of Park, Kim, Hirai 2003, eq. 13, with the surface's height added: dL = sqrt(a^2 - r^2) - (a - d) + h; Hertz compares with a radius 1 / (1/a + 1/R)",
    keys: &[Key::number("curvature_per_mm", "1 / R; 0 is a plane.", 0.0, 1.0, 0.05)],
    zero: &[("curvature_per_mm", 0.0)],
    build: |build: &Build| Part::Shape(Box::new(Sphere { per_mm: build.values.number("curvature_per_mm") })),
};

struct Sphere {
    per_mm: f64,
}

impl Shape for Sphere {
    fn height_mm(&self, x_mm: f64, y_mm: f64, _radius_mm: f64) -> f64 {
        round(self.per_mm, x_mm * x_mm + y_mm * y_mm)
    }

    fn plain(&self) -> bool {
        self.per_mm == 0.0
    }
}
