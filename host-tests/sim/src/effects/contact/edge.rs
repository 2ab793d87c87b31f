//! The plane ends at an edge: beyond it there is nothing.

use super::{NOTHING_MM, Shape};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "edge",
    family: Family::Contact,
    about: "The plane ends at an edge: beyond it there is nothing.",
    equations: &["h = 0 where x cos(t) + y sin(t) <= offset_mm, else nothing touches"],
    state: "none",
    reference: "the compression of Park, Kim, Hirai 2003, eq. 13, with the surface's height added: dL = sqrt(a^2 - r^2) - (a - d) + h",
    keys: &[
        Key::number("offset_mm", "From the contact's centre to the edge.", -20.0, 20.0, 0.0),
        Key::number(
            "towards_deg",
            "Which way the edge lies: 0 along the columns, 90 along the rows.",
            -180.0,
            180.0,
            0.0,
        ),
    ],
    zero: &[("offset_mm", 20.0)],
    build: |build: &Build| {
        let angle = build.values.number("towards_deg") * (core::f64::consts::PI / 180.0);
        Part::Shape(Box::new(Edge {
            offset_mm: build.values.number("offset_mm"),
            towards: [libm::cos(angle), libm::sin(angle)],
        }))
    },
};

/// No tip is larger (`[tip]`, `radius_mm`).
const LARGEST_TIP_MM: f64 = 16.0;

struct Edge {
    offset_mm: f64,
    towards: [f64; 2],
}

impl Shape for Edge {
    fn height_mm(&self, x_mm: f64, y_mm: f64, _radius_mm: f64) -> f64 {
        let far = self.towards[0] * x_mm + self.towards[1] * y_mm > self.offset_mm;
        if far { NOTHING_MM } else { 0.0 }
    }

    fn plain(&self) -> bool {
        self.offset_mm >= LARGEST_TIP_MM
    }
}
