//! The driven row's switch and trace take a part of its voltage.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "row_sag",
    family: Family::Sensor,
    about: "The driven row's switch and trace take a part of its voltage. The controller corrects for it, unless [controller] says \
            otherwise.",
    equations: &["G' = G / (1 + R_on S), S = the row's sum of G: a loss of R_on S / (1 + R_on S)"],
    state: "none",
    reference: "docs/board.md: 30 Ohm; R_min 1 kOhm in all ten columns loses 41 % at 70 Ohm and 4.8 % at 5 Ohm",
    keys: &[Key::number("switch_ohm", "Resistance of switch and trace, R_on.", 0.0, 300.0, 30.0)],
    zero: &[("switch_ohm", 0.0)],
    build: |build: &Build| {
        let switch_ohm = build.values.number("switch_ohm");
        Part::Network(Box::new(move |_, _, seen| {
            let left = 1.0 + switch_ohm * seen.iter().sum::<f64>();
            seen.iter_mut().for_each(|siemens| *siemens /= left);
        }))
    },
};
