//! The tip's memory, the object behind its surface, and friction along it.

use super::{Grip, Memory, Strength};
use crate::effects::normal_within_3;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};
use crate::watch::Truth;
use fastrand::Rng;

pub(super) const RELAXATION: Description = Description {
    name: "relaxation",
    family: Family::Contact,
    about: "The soft tip forgets a share of its force while it is held.",
    equations: &[
        "F = F_e - share q, at least 0;  tau_s dq/dt = F_e - q  (quasi-linear, one term)",
        "over a step: q goes to F_e exponentially, half a step before and half a step after the motion",
        "where F_e < share q the tip is not yet back in shape and does not touch; then tau_s dq/dt = (share - 1) q",
    ],
    state: "the force remembered, N",
    reference: "Fung, Biomechanics, 1993, 7.6; Park, Kim, Hirai 2003 leave it out; in fixed point it is paper::Relaxation",
    keys: &[
        Key::number("share", "Share of the force that is forgotten in the end.", 0.0, 0.95, 0.15),
        Key::number("tau_s", "Time constant.", 0.0001, 10000.0, 0.5),
    ],
    zero: &[("share", 0.0)],
    build: |build: &Build| {
        let (share, tau_s) = (build.values.number("share"), build.values.number("tau_s"));
        Part::Memory(Box::new(Relaxation { share, tau_s, remembered_n: 0.0, last_s: 0.0, left: [1.0; 2] }))
    },
};

struct Relaxation {
    share: f64,
    tau_s: f64,
    remembered_n: f64,
    /// The last time step, and what is left of a difference after it: held, and free.
    last_s: f64,
    left: [f64; 2],
}

impl Memory for Relaxation {
    fn forgotten_n(&mut self) -> f64 {
        self.share * self.remembered_n
    }

    fn relax(&mut self, dt_s: f64, elastic_n: Option<f64>) {
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

pub(super) const OBJECT_STIFFNESS: Description = Description {
    name: "object_stiffness",
    family: Family::Contact,
    about: "The object yields like a spring behind its surface.",
    equations: &["x = d + yield_mm_per_n F: tip and object in series", "E = E_tip(d) + yield_mm_per_n F^2 / 2"],
    state: "none",
    reference: "two springs in series; a soft ball 0.1 to 2 mm/N",
    keys: &[Key::number("yield_mm_per_n", "How far it yields for each force; 0 is rigid.", 0.0, 1000.0, 0.5)],
    zero: &[("yield_mm_per_n", 0.0)],
    build: |build: &Build| {
        let mm_per_n = build.values.number("yield_mm_per_n");
        Part::Series(Box::new(move || mm_per_n))
    },
};

pub(super) const BREAKABLE_OBJECT: Description = Description {
    name: "breakable_object",
    family: Family::Contact,
    about: "The object breaks under too high a force, and then gives way.",
    equations: &["once F > force_n: F and its energy fall to the share left of what they were, for good"],
    state: "whether it is broken",
    reference: "a raspberry is crushed by 1 to 2 N",
    keys: &[
        Key::number("force_n", "The force that it bears.", 0.0, 1000000.0, 1.5),
        Key::number("left", "Share of the force that is left after.", 0.001, 1.0, 0.2),
    ],
    zero: &[("force_n", 1000000.0)],
    build: |build: &Build| {
        let (force_n, left) = (build.values.number("force_n"), build.values.number("left"));
        Part::Strength(Box::new(BreakableObject { force_n, left, broken: false }))
    },
};

struct BreakableObject {
    force_n: f64,
    left: f64,
    broken: bool,
}

impl Strength for BreakableObject {
    fn left(&mut self, force_n: f64) -> f64 {
        self.broken |= force_n > self.force_n;
        if self.broken { self.left } else { 1.0 }
    }

    fn tell(&self, truth: &mut Truth) {
        truth.broken |= self.broken;
    }
}

pub(super) const TANGENTIAL: Description = Description {
    name: "tangential",
    family: Family::Contact,
    about: "Friction along the surface: the patch gives a little, sticks, and slips.",
    equations: &[
        "T = n_per_mm s + damping_n_s_per_mm ds/dt, s the way of the object against the tip since they stick",
        "it slips where T > still N; while it slips T = slipping N, and it sticks again once the motion turns",
        "the patch's centre on the array moves by s",
        "both shares times 1 + spread_percent / 100 g, g normal within 3 deviations, drawn once",
    ],
    state: "stretch of the patch, way slipped (mm), and which way it slips",
    reference: "Coulomb friction behind a spring (Dahl; Mindlin's full stick): silicone on skin-like surfaces 0.5 to 1",
    keys: &[
        Key::number("n_per_mm", "Stiffness of the patch along the surface.", 0.001, 1000.0, 1.0),
        Key::number("damping_n_s_per_mm", "Damping of the patch along the surface.", 0.0, 10.0, 0.001),
        Key::number("still", "Share of the normal force at which it begins to slip.", 0.0, 10.0, 0.8),
        Key::number("slipping", "Share of the normal force while it slips; at most `still` counts.", 0.0, 10.0, 0.7),
        Key::number(
            "spread_percent",
            "Deviation of both shares from finger to finger and seed to seed.",
            0.0,
            30.0,
            0.0,
        ),
        Key::number("drift_mm_per_s", "How fast an object that stands fast is drawn along.", -1000.0, 1000.0, 0.0),
        Key::number("drift_from_s", "From when.", 0.0, 1000000.0, 0.0),
    ],
    zero: &[("drift_mm_per_s", 0.0)],
    build: |build: &Build| {
        let values = build.values;
        let spread = values.number("spread_percent") / 100.0;
        let drawn = 1.0 + spread * normal_within_3(&mut Rng::with_seed(build.seed));
        let grip = Grip {
            n_per_mm: values.number("n_per_mm"),
            n_s_per_mm: values.number("damping_n_s_per_mm"),
            still: drawn * values.number("still"),
            slipping: drawn * values.number("slipping").min(values.number("still")),
            drift_mm_per_s: values.number("drift_mm_per_s"),
            drift_from_s: values.number("drift_from_s"),
        };
        Part::Tangent(Box::new(move || grip))
    },
};

pub(super) const OBJECT_MASS: Description = Description {
    name: "object_mass",
    family: Family::Contact,
    about: "The object can move: it has a mass, and weighs.",
    equations: &[
        "m dX/dt^2 = N_1 - N_2 between the fingers, m dY/dt^2 = T_1 + T_2 - m g + floor, upwards",
        "the floor stops it without a bounce",
    ],
    state: "place and speed of the object along the fingers' motion and upwards",
    reference: "Newton; g = 9.80665 m/s^2",
    keys: &[Key::number("mass_g", "Its mass; 0 stands fast.", 0.0, 10000.0, 20.0)],
    zero: &[("mass_g", 0.0)],
    build: |build: &Build| {
        let kg = build.values.number("mass_g") * 1e-3;
        Part::Body(Box::new(move || kg))
    },
};
