//! The object's surface: tilted, round, or ended by an edge.

use super::{NOTHING_MM, Shape, round};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

pub(super) const TILTED_PLANE: Description = Description {
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

pub(super) const SPHERE: Description = Description {
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

pub(super) const CYLINDER: Description = Description {
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

pub(super) const EDGE: Description = Description {
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
