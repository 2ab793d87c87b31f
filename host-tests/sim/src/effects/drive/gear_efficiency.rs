//! The gear takes a share of the torque that goes through it.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "gear_efficiency",
    family: Family::Drive,
    about: "The gear takes a share of the torque that goes through it.",
    equations: &[
        "T_f = (1 / efficiency - 1) T, T the tip's load at the shaft; it takes the sign of the motion and holds at rest",
        "pressing, the share efficiency of the torque arrives; pushed back, the motor feels T (2 - 1 / efficiency)",
    ],
    state: "none",
    reference: "docs/plant.md: FAULHABER 14/1 at 43:1, 70 %, github.com/ekrimsk/MGDB",
    keys: &[Key::number(
        "efficiency",
        "Share of the torque that arrives when the motor drives the load.",
        0.1,
        1.0,
        0.7,
    )],
    zero: &[("efficiency", 1.0)],
    build: |build: &Build| {
        let share = 1.0 / build.values.number("efficiency") - 1.0;
        Part::Resist(Box::new(move |_, friction| friction.load_share += share))
    },
};
