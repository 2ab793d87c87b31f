//! Every effect by its name. A scene is read, explained and documented by this table, and built from it.

use crate::effects::{Build, Part, contact, drive, link, sensor, stream};
use crate::key::{Key, Values};

/// An effect as the table knows it. Each stands in the file that holds its equations, as a
/// `pub const EFFECT: Description`.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Its name in a scene: `[effects.NAME]`.
    pub name: &'static str,
    /// Where it acts.
    pub family: Family,
    /// What it is, in a line.
    pub about: &'static str,
    /// Its equations, a line each, in plain text.
    pub equations: &'static [&'static str],
    /// The state that it adds; "none" where it has none.
    pub state: &'static str,
    /// Where equations and magnitudes come from.
    pub reference: &'static str,
    /// Its keys.
    pub keys: &'static [Key],
    /// What its keys must be for it to change nothing; keys not listed may be anything.
    pub zero: &'static [(&'static str, f64)],
    /// Builds it for one finger.
    pub build: fn(&Build) -> Part,
}

/// Where an effect acts. Each family has a folder, and for each of its stages a trait or a function's type: what its
/// effects may touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// From the taxels' pressure to the frame's codes.
    Sensor,
    /// Between tip and object.
    Contact,
    /// From the duty to the tip's way.
    Drive,
    /// Clocks, electronics, bus and host.
    Link,
}

impl Family {
    /// In a word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Contact => "contact",
            Self::Drive => "drive",
            Self::Link => "link",
        }
    }

    /// As a heading.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Sensor => "Sensor: from pressure to codes",
            Self::Contact => "Contact: between tip and object",
            Self::Drive => "Drive: from the duty to the tip's way",
            Self::Link => "Link: clocks, electronics, bus and host",
        }
    }
}

/// An effect that a scene names.
#[derive(Clone, Debug)]
pub struct Named {
    /// What it is.
    pub effect: &'static Description,
    /// Its values.
    pub values: Values,
}

/// Every effect, in the order in which they act within a stage: interference comes before the converter.
pub fn all() -> impl Iterator<Item = &'static Description> {
    [link::EFFECTS, sensor::EFFECTS, contact::EFFECTS, drive::EFFECTS].into_iter().flatten().copied()
}

/// Builds the named effects of a finger, each with its name.
pub fn build(named: &[Named], seed: u64, finger: usize) -> impl Iterator<Item = (&'static str, Part)> {
    named.iter().map(move |Named { effect, values }| {
        let build = Build { values, seed: stream(seed, effect.name, finger) };
        (effect.name, (effect.build)(&build))
    })
}
