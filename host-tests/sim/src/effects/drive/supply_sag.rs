//! The source, its wires and connectors have a resistance.

use super::{Circuit, Electric};
use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "supply_sag",
    family: Family::Drive,
    about: "The source, its wires and connectors have a resistance.",
    equations: &[
        "the bridge takes the share u of the current: V = source_v - source_ohm u i",
        "so the motor sees u^2 source_ohm in series",
    ],
    state: "none",
    reference: "docs/plant.md: 0.1 Ohm",
    keys: &[Key::number("source_ohm", "Resistance of source, wires and connectors.", 0.0, 100.0, 0.1)],
    zero: &[("source_ohm", 0.0)],
    build: |build: &Build| Part::Electric(Box::new(SupplySag { ohm: build.values.number("source_ohm") })),
};

struct SupplySag {
    ohm: f64,
}

impl Electric for SupplySag {
    fn apply(&mut self, circuit: &mut Circuit) {
        circuit.source_ohm += self.ohm;
    }
}
