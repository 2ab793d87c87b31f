//! Taxels that are dead, stuck or shorted.

use crate::effects::{Build, Part};
use crate::key::{Key, Kind};
use crate::registry::{Description, Family};
use crate::setup::Array;
use fingertip::shipped::{COLUMNS, ROWS};

const TAXELS: Kind = Kind::Pairs { below: ROWS as i64 };

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "broken_taxels",
    family: Family::Sensor,
    about: "Taxels that are dead, stuck or shorted, from a time on.",
    equations: &["dead: G = 0", "shorted: G = 0.1 S (10 Ohm)", "stuck: G = what it was at the first sample after at_s"],
    state: "the conductance at which each stuck taxel is stuck",
    reference: "docs/plant.md, defects of the array",
    keys: &[
        Key { name: "dead", about: "Open circuits, by row and column.", kind: TAXELS },
        Key { name: "shorted", about: "Short circuits, by row and column.", kind: TAXELS },
        Key { name: "stuck", about: "Taxels that no longer change, by row and column.", kind: TAXELS },
        Key::number("at_s", "When they break; -10 is before the tare.", -10.0, 1e6, -10.0),
    ],
    zero: &[],
    build: |build: &Build| {
        let mut taxels = [[Taxel::Sound; COLUMNS]; ROWS];
        let shorted = Taxel::Fixed(Array::default().short_siemens);
        for (name, taxel) in [("stuck", Taxel::Stuck), ("shorted", shorted), ("dead", Taxel::Fixed(0.0))] {
            build.values.pairs(name).iter().for_each(|[row, column]| taxels[*row as usize][*column as usize] = taxel);
        }
        let at_s = build.values.number("at_s");
        Part::Conductance(Box::new(move |row, time_s, siemens| {
            if time_s < at_s {
                return;
            }
            for (taxel, siemens) in taxels[row].iter_mut().zip(siemens) {
                match *taxel {
                    Taxel::Sound => {}
                    Taxel::Stuck => *taxel = Taxel::Fixed(*siemens),
                    Taxel::Fixed(fixed) => *siemens = fixed,
                }
            }
        }))
    },
};

#[derive(Clone, Copy)]
enum Taxel {
    Sound,
    Stuck,
    Fixed(f64),
}
