//! Contact between tip and object.
//!
//! Where tip and object overlap by x, the tip is indented by d and pushes back with F. The stages in order: the surface
//! of the object (shape), the relaxation of the tip (memory), the compliance of the object (series), the share of the
//! force that remains (strength), and the motion along the surface (tangent). Without effects the object is a rigid
//! plane without friction: d = x, F = pi Y d^2. All forces of a step are the mean slope of one energy, so a step
//! creates no energy.

use crate::effects::{Build, Description, Metered, Parts, Stage, normal_within_3};
use crate::mechanics::decay;
use crate::scene::tables::Key;
use crate::watch::Cost;

/// Height of the surface towards the tip above the plane from which indentations count, mm; negative where the surface
/// falls away. The arguments are x along the columns of the array and y along its rows, from the axis of the tip, and the
/// radius of the tip.
type Height = dyn Fn(f64, f64, f64) -> f64 + Send;

pub struct Surface {
    /// True if the height is 0 within reach of a tip, so that the closed forms of the plane hold.
    plain: bool,
    height_mm: Box<Height>,
}

impl Surface {
    fn add(build: &Build, parts: &mut Parts, plain: bool, height_mm: impl Fn(f64, f64, f64) -> f64 + Send + 'static) {
        parts.contact.shape.push(build.part(Box::new(Self { plain, height_mm: Box::new(height_mm) })));
    }
}

/// Height beyond the end of an object: no tip reaches it.
const NOTHING_MM: f64 = -1e3;

/// Height of a round surface at the square of a distance from its highest point or line.
fn round(per_mm: f64, distance2_mm2: f64) -> f64 {
    let turned = per_mm * per_mm * distance2_mm2;
    // R - sqrt(R^2 - s^2) without cancellation for a large R.
    if turned < 1.0 { -per_mm * distance2_mm2 / (1.0 + (1.0 - turned).sqrt()) } else { NOTHING_MM }
}

/// Friction along the surface, and compliance of the patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Stiffness of the patch along the surface.
    pub n_per_mm: f64,
    /// Damping of the patch along the surface.
    pub n_s_per_mm: f64,
    /// Friction coefficient at which the patch begins to slip.
    pub still: f64,
    /// Friction coefficient while it slips.
    pub slipping: f64,
    /// Speed of an object that the scene moves.
    pub drift_mm_per_s: f64,
    pub drift_from_s: f64,
}

named! {
    shape: Surface,
    memory: Relaxation,
    // Compliance of the object behind its surface, mm/N.
    series: f64,
    strength: BreakableObject,
    tangent: Grip,
    // Mass of the object, kg; none if it is fixed.
    body: f64,
}

impl Named {
    /// True if the surface is not a plane.
    pub fn shaped(&self) -> bool {
        self.shape.parts().any(|surface| !surface.plain)
    }

    pub fn height_mm(&self, x_mm: f64, y_mm: f64, radius_mm: f64) -> f64 {
        self.shape.parts().map(|surface| (surface.height_mm)(x_mm, y_mm, radius_mm)).sum()
    }

    pub fn grip(&mut self) -> Option<Grip> {
        self.tangent.map(|grip| *grip).last()
    }
}

/// Effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[Description] = &[
    Description {
        name: "tilted_plane",
        about: "A plane that is tilted against the array.",
        equations: &[
            "h = x tan(along_columns_deg) + y tan(along_rows_deg), less the offset that gives the first contact at d = 0",
            "force by the integral of p = Y dL / L over the tip",
        ],
        state: "none",
        reference: "Park, Kim, Hirai 2003, eq. 13, with the surface's height h: dL = sqrt(a^2 - r^2) - (a - d) + h",
        keys: &[
            Key::number("along_columns_deg", "Tilt along the columns; positive presses higher ones.", -45.0, 45.0, 5.0)
                .idle(0.0),
            Key::number("along_rows_deg", "Tilt along the rows.", -45.0, 45.0, 0.0).idle(0.0),
        ],
        build: |build, parts| {
            let slope = |name| libm::tan(build.number(name) * (core::f64::consts::PI / 180.0));
            let (x, y) = (slope("along_columns_deg"), slope("along_rows_deg"));
            // Additional reach of a slope into the tip, as a share of its radius.
            let over = (1.0 + x * x + y * y).sqrt() - 1.0;
            let height_mm = move |x_mm, y_mm, radius_mm| x * x_mm + y * y_mm - over * radius_mm;
            Surface::add(build, parts, x == 0.0 && y == 0.0, height_mm);
        },
    },
    Description {
        name: "sphere",
        about: "A ball instead of the plane.",
        equations: &["h = -(R - sqrt(R^2 - r^2)); nothing beyond R"],
        state: "none",
        reference: "as `tilted_plane`; Hertz compares with a radius 1 / (1/a + 1/R)",
        keys: &[Key::number("curvature_per_mm", "1 / radius; 0 is a plane.", 0.0, 1.0, 0.05).idle(0.0)],
        build: |build, parts| {
            let per_mm = build.number("curvature_per_mm");
            Surface::add(build, parts, per_mm == 0.0, move |x, y, _| round(per_mm, x * x + y * y));
        },
    },
    Description {
        name: "cylinder",
        about: "A cylinder instead of the plane, at any angle.",
        equations: &["h = -(R - sqrt(R^2 - s^2)), s the distance from the axis; nothing beyond R"],
        state: "none",
        reference: "as `tilted_plane`",
        keys: &[
            Key::number("curvature_per_mm", "1 / radius; 0 is a plane.", 0.0, 1.0, 0.1).idle(0.0),
            Key::number("axis_deg", "Angle from the columns to the axis.", -180.0, 180.0, 90.0),
        ],
        build: |build, parts| {
            let angle = build.number("axis_deg") * (core::f64::consts::PI / 180.0);
            let (across, per_mm) = ([-libm::sin(angle), libm::cos(angle)], build.number("curvature_per_mm"));
            Surface::add(build, parts, per_mm == 0.0, move |x_mm, y_mm, _| {
                let across_mm = across[0] * x_mm + across[1] * y_mm;
                round(per_mm, across_mm * across_mm)
            })
        },
    },
    Description {
        name: "edge",
        about: "A plane that ends at an edge.",
        equations: &["h = 0 where x cos(t) + y sin(t) <= offset_mm, else nothing touches"],
        state: "none",
        reference: "as `tilted_plane`",
        keys: &[
            Key::number("offset_mm", "Distance from the centre of the contact to the edge.", -20.0, 20.0, 0.0)
                .idle(20.0),
            Key::number("towards_deg", "Direction: 0 along the columns, 90 along the rows.", -180.0, 180.0, 0.0),
        ],
        build: |build, parts| {
            let angle = build.number("towards_deg") * (core::f64::consts::PI / 180.0);
            let (towards, offset_mm) = ([libm::cos(angle), libm::sin(angle)], build.number("offset_mm"));
            Surface::add(build, parts, offset_mm >= LARGEST_TIP_MM, move |x_mm, y_mm, _| {
                if towards[0] * x_mm + towards[1] * y_mm > offset_mm { NOTHING_MM } else { 0.0 }
            })
        },
    },
    Description {
        name: "relaxation",
        about: "Relaxation: the soft tip loses a share of a held force.",
        equations: &[
            "F = F_e - share q, at least 0;  tau_s dq/dt = F_e - q  (quasi-linear, one term)",
            "over a step: q goes to F_e exponentially, half a step before and half a step after the motion",
            "F_e < share q: the tip has not recovered and does not touch; then tau_s dq/dt = (share - 1) q",
        ],
        state: "relaxed force, N",
        reference: "Fung, Biomechanics, 1993, 7.6; not in Park, Kim, Hirai 2003",
        keys: &[
            Key::number("share", "Share of the force that is lost in the end.", 0.0, 0.95, 0.15).idle(0.0),
            Key::number("tau_s", "Time constant.", 0.0001, 10000.0, 0.5),
        ],
        build: |build, parts| {
            let (share, tau_s) = (build.number("share"), build.number("tau_s"));
            let memory = Relaxation { share, tau_s, remembered_n: 0.0, last_s: 0.0, left: [1.0; 2] };
            parts.contact.memory.push(build.part(Box::new(memory)));
        },
    },
    Description {
        name: "object_stiffness",
        about: "An object that yields like a spring.",
        equations: &["x = d + yield_mm_per_n F: tip and object in series", "E = E_tip(d) + yield_mm_per_n F^2 / 2"],
        state: "none",
        reference: "two springs in series; a soft ball 0.1 to 2 mm/N",
        keys: &[Key::number("yield_mm_per_n", "Compliance; 0 is rigid.", 0.0, 1000.0, 0.5).idle(0.0)],
        build: |build, parts| parts.contact.series.push(build.part(Box::new(build.number("yield_mm_per_n")))),
    },
    Description {
        name: "breakable_object",
        about: "An object that breaks under too much force and then yields.",
        equations: &["once F > force_n: F and its energy fall to the share `left` for the rest of the run"],
        state: "broken or not",
        reference: "a raspberry is crushed by 1 to 2 N",
        keys: &[
            Key::number("force_n", "Force at which it breaks.", 0.0, 1000000.0, 1.5).idle(1000000.0),
            Key::number("left", "Share of the force that remains afterwards.", 0.001, 1.0, 0.2),
        ],
        build: |build, parts| {
            let (force_n, left) = (build.number("force_n"), build.number("left"));
            parts.contact.strength.push(build.part(Box::new(BreakableObject { force_n, left, broken: false })))
        },
    },
    Description {
        name: "tangential",
        about: "Friction along the surface: the patch is elastic, sticks, and slips.",
        equations: &[
            "T = n_per_mm s + damping_n_s_per_mm ds/dt, s the displacement of object against tip since they stick",
            "it slips if T > still N; then T = slipping N until the motion reverses and it sticks again",
            "the patch's centre on the array moves by s",
            "both coefficients times 1 + g spread_percent / 100, g normal within 3 deviations, drawn once",
        ],
        state: "stretch of the patch, distance slipped (mm), and direction of the slip",
        reference: "Coulomb friction behind a spring (Dahl; Mindlin's full stick): friction coefficient 0.5 to 1 for silicone on skin-like surfaces",
        keys: &[
            Key::number("n_per_mm", "Stiffness of the patch along the surface.", 0.001, 1000.0, 1.0),
            Key::number("damping_n_s_per_mm", "Damping of the patch along the surface.", 0.0, 10.0, 0.001),
            Key::number("still", "Friction coefficient at which it begins to slip.", 0.0, 10.0, 0.8),
            Key::number("slipping", "Friction coefficient while it slips, at most `still`.", 0.0, 10.0, 0.7),
            Key::number("spread_percent", "Deviation of both coefficients between fingers and seeds.", 0.0, 30.0, 0.0),
            Key::number("drift_mm_per_s", "Speed of a fixed object along the surface.", -1000.0, 1000.0, 0.0).idle(0.0),
            Key::number("drift_from_s", "Start of that motion.", 0.0, 1000000.0, 0.0),
        ],
        build: |build, parts| {
            let number = |name| build.number(name);
            let spread = number("spread_percent") / 100.0;
            let drawn = 1.0 + spread * normal_within_3(&mut build.rng());
            let grip = Grip {
                n_per_mm: number("n_per_mm"),
                n_s_per_mm: number("damping_n_s_per_mm"),
                still: drawn * number("still"),
                slipping: drawn * number("slipping").min(number("still")),
                drift_mm_per_s: number("drift_mm_per_s"),
                drift_from_s: number("drift_from_s"),
            };
            parts.contact.tangent.push(build.part(Box::new(grip)))
        },
    },
    Description {
        name: "object_mass",
        about: "An object that can move and has a weight.",
        equations: &[
            "m dX/dt^2 = N_1 - N_2 between the fingers, m dY/dt^2 = T_1 + T_2 - m g + floor, upwards",
            "the floor stops it without a bounce",
        ],
        state: "place and speed of the object along the fingers' motion and upwards",
        reference: "Newton; g = 9.80665 m/s^2",
        keys: &[Key::number("mass_g", "Mass; 0 is a fixed object.", 0.0, 10000.0, 20.0).idle(0.0)],
        build: |build, parts| parts.contact.body.push(build.part(Box::new(build.number("mass_g") * 1e-3))),
    },
];

/// Largest radius of a tip (`[tip]`, `radius_mm`).
const LARGEST_TIP_MM: f64 = 16.0;

pub struct Relaxation {
    share: f64,
    tau_s: f64,
    remembered_n: f64,
    /// Last time step, and the share of a difference that remains after it: in contact, and free.
    last_s: f64,
    left: [f64; 2],
}

impl Relaxation {
    /// Force to subtract from the elastic force.
    pub fn forgotten_n(&self) -> f64 {
        self.share * self.remembered_n
    }

    /// Advances in time at a constant elastic force; none while the tip touches nothing.
    pub fn relax(&mut self, dt_s: f64, elastic_n: Option<f64>) {
        if dt_s != self.last_s {
            self.last_s = dt_s;
            self.left = [1.0, 1.0 - self.share].map(|rate| decay(dt_s / self.tau_s * rate));
        }
        let [held, free] = self.left;
        self.remembered_n = match elastic_n {
            Some(elastic_n) => elastic_n + (self.remembered_n - elastic_n) * held,
            None => self.remembered_n * free,
        };
    }
}

/// Object that limits the force on it.
pub struct BreakableObject {
    force_n: f64,
    left: f64,
    pub broken: bool,
}

impl BreakableObject {
    /// Returns the share of a force that remains after the object was loaded by it.
    pub fn left(&mut self, force_n: f64) -> f64 {
        self.broken |= force_n > self.force_n;
        if self.broken { self.left } else { 1.0 }
    }
}
