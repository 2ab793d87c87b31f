//! The winding's current takes time to follow.

use super::{Circuit, Electric};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "winding_inductance",
    family: Family::Drive,
    about: "The winding's current takes time to follow.",
    equations: &[
        "L di/dt = u V - R i - k w",
        "over a step: i = i_end + (i_0 - i_end) exp(-t R / L), i_end = (u V - k w) / R, exact at a held speed",
        "an open bridge takes the current at once",
    ],
    state: "current in the winding, A",
    reference: "FAULHABER data sheet 1331 T 006 SR: 70 uH",
    keys: &[Key::number("inductance_uh", "Inductance of the winding.", 0.0, 100000.0, 70.0)],
    zero: &[("inductance_uh", 0.0)],
    build: |build: &Build| {
        Part::Electric(Box::new(WindingInductance { henry: build.values.number("inductance_uh") * 1e-6 }))
    },
};

struct WindingInductance {
    henry: f64,
}

impl Electric for WindingInductance {
    fn apply(&mut self, circuit: &mut Circuit) {
        circuit.henry += self.henry;
    }
}
