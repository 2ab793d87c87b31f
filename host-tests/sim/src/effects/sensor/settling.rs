//! The columns are sampled before they have settled.

use super::Row;
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::mechanics::decay::decay;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "settling",
    family: Family::Sensor,
    about: "Each column still carries a part of the slot before when it is sampled.",
    equations: &[
        "dv/dt = (V - v) / tau_us, V what the slot settles to",
        "sampled at after_us behind the slot's edge: v = V + (v_edge - V) exp(-after_us / tau_us), exact",
    ],
    state: "voltage of each column at the last edge, and what it settles to (20 numbers)",
    reference: "docs/plant.md, readout: 0.2 us; half a bit of 12 takes 9.0 tau",
    keys: &[
        Key::number("tau_us", "Time constant.", 0.0, 100.0, 0.2),
        Key::number("after_us", "From the edge to the sample.", 0.1, 1000.0, 2.4),
    ],
    zero: &[("tau_us", 0.0)],
    build: |build: &Build| {
        let [tau_s, after_s] = ["tau_us", "after_us"].map(|key| build.values.number(key) * 1e-6);
        let mut settling = Settling::new(tau_s, after_s);
        Part::Volts(Box::new(move |_, time_s, volts| settling.sample(time_s, volts)))
    },
};

/// How far the columns have settled.
pub struct Settling {
    tau_s: f64,
    /// What is left of a difference at the sample.
    left: f64,
    before: Option<Before>,
}

impl Settling {
    /// Not scanned yet.
    pub fn new(tau_s: f64, after_s: f64) -> Self {
        Self { tau_s, left: decay(after_s / tau_s), before: None }
    }
    /// What the columns have come to, in place of what they settle to, at a sample.
    pub fn sample(&mut self, time_s: f64, volts: &mut Row) {
        let end_v = *volts;
        let edge_v = match &self.before {
            None => end_v,
            Some(Before { time_s: before_s, edge_v, end_v }) => {
                let left = decay((time_s - before_s) / self.tau_s);
                core::array::from_fn(|column| end_v[column] + left * (edge_v[column] - end_v[column]))
            }
        };
        for (volts, edge) in volts.iter_mut().zip(edge_v) {
            *volts += self.left * (edge - *volts);
        }
        self.before = Some(Before { time_s, edge_v, end_v });
    }
}

struct Before {
    time_s: f64,
    edge_v: Row,
    end_v: Row,
}
