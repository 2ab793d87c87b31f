//! The soft tip forgets a share of its force while it is held.

use super::Memory;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
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
