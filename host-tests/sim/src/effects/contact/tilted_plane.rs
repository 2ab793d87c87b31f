//! The plane is tilted against the array.

use super::Shape;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "tilted_plane",
    family: Family::Contact,
    about: "The plane is tilted against the array.",
    equations: &[
        "h = x tan(along_columns_deg) + y tan(along_rows_deg), less what brings the first point touched to d = 0",
        "force by the integral of p = Y dL / L over the tip",
    ],
    state: "none",
    reference: "the compression of Park, Kim, Hirai 2003, eq. 13, with the surface's height added: dL = sqrt(a^2 - r^2) - (a - d) + h",
    keys: &[
        Key::number(
            "along_columns_deg",
            "Tilt along the columns; where positive, the columns beyond the centre are pressed more.",
            -45.0,
            45.0,
            5.0,
        ),
        Key::number("along_rows_deg", "The same along the rows.", -45.0, 45.0, 0.0),
    ],
    zero: &[("along_columns_deg", 0.0), ("along_rows_deg", 0.0)],
    build: |build: &Build| {
        let slope = |name| {
            let angle = build.values.number(name) * (core::f64::consts::PI / 180.0);
            libm::tan(angle)
        };
        let (x, y) = (slope("along_columns_deg"), slope("along_rows_deg"));
        // How much farther a slope reaches into the tip, as a share of its radius.
        let over = (1.0 + x * x + y * y).sqrt() - 1.0;
        Part::Shape(Box::new(TiltedPlane { x, y, over }))
    },
};

struct TiltedPlane {
    x: f64,
    y: f64,
    over: f64,
}

impl Shape for TiltedPlane {
    fn height_mm(&self, x_mm: f64, y_mm: f64, radius_mm: f64) -> f64 {
        self.x * x_mm + self.y * y_mm - self.over * radius_mm
    }

    fn plain(&self) -> bool {
        self.x == 0.0 && self.y == 0.0
    }
}
