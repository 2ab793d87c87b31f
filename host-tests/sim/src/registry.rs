//! All effects by name. The reader, the descriptions, the documentation and the board use this table.

use crate::effects::{Build, Part, contact, drive, link, sensor, stream};
use crate::scene::tables::{Key, Values};

/// Description of an effect. It is next to the equations in the table of its family.
#[derive(Clone, Copy, Debug)]
pub struct Description {
    /// Name in a scene: `[effects.NAME]`.
    pub name: &'static str,
    /// Description in one line.
    pub about: &'static str,
    /// Equations in plain text, one per line.
    pub equations: &'static [&'static str],
    /// Additional state; "none" without one.
    pub state: &'static str,
    /// Source of equations and magnitudes.
    pub reference: &'static str,
    pub keys: &'static [Key],
    /// Values of keys at which the effect changes nothing. Other keys may have any value.
    pub zero: &'static [(&'static str, f64)],
    pub build: fn(&Build) -> Part,
}

/// A family of effects, by the place at which they act.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    pub name: &'static str,
    /// Heading on the reference page.
    pub title: &'static str,
    /// Effects, in the order in which they act within a stage.
    pub effects: &'static [Description],
}

/// Effects between tip and object.
pub const CONTACT: Family =
    Family { name: "contact", title: "Contact: between tip and object", effects: contact::EFFECTS };
/// Effects from the duty to the travel of the tip.
pub const DRIVE: Family =
    Family { name: "drive", title: "Drive: from the duty to the tip's way", effects: drive::EFFECTS };
/// Effects from the pressure on the taxels to the codes of the frame.
pub const SENSOR: Family = Family { name: "sensor", title: "Sensor: from pressure to codes", effects: sensor::EFFECTS };
/// Effects on clocks, electronics, bus and host.
pub const LINK: Family =
    Family { name: "link", title: "Link: clocks, electronics, bus and host", effects: link::EFFECTS };

/// All families, in the order in which their effects act within a stage: interference comes before the converter.
const FAMILIES: [Family; 4] = [LINK, SENSOR, CONTACT, DRIVE];

/// Effect of a scene.
#[derive(Clone, Debug)]
pub struct Named {
    pub effect: &'static Description,
    pub values: Values,
}

/// Returns every effect, in the order in which they act within a stage.
pub fn all() -> impl Iterator<Item = &'static Description> {
    FAMILIES.iter().flat_map(|family| family.effects)
}

pub fn family_of(effect: &Description) -> &'static str {
    let family = FAMILIES.iter().find(|family| family.effects.iter().any(|known| known.name == effect.name));
    family.map_or("", |family| family.name)
}

pub fn build(named: &[Named], seed: u64, finger: usize) -> impl Iterator<Item = (&'static str, Part)> {
    named.iter().map(move |Named { effect, values }| {
        (effect.name, (effect.build)(&Build::new(values, stream(seed, effect.name, finger))))
    })
}
