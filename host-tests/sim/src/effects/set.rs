//! What effects are compiled into a run: those that the scene names, or none.

use super::{contact, drive, link, sensor};
use crate::registry;
use crate::scene::Scene;
use crate::watch::Cost;

/// One finger's effects by family.
pub struct Parts<E: Set + ?Sized> {
    /// On the array.
    pub sensor: E::Sensor,
    /// On the contact.
    pub contact: E::Contact,
    /// On the drive.
    pub drive: E::Drive,
    /// On clock and bus.
    pub link: E::Link,
}

/// A set of effects: [`Named`], or `()` in which none is compiled.
pub trait Set {
    /// On the array.
    type Sensor: sensor::Stages;
    /// On the contact.
    type Contact: contact::Stages;
    /// On the drive.
    type Drive: drive::Stages;
    /// On clock and bus.
    type Link: link::Stages;

    /// Those of a finger.
    fn of(scene: &Scene, finger: usize) -> Parts<Self>;

    /// What each has cost so far.
    fn costs(sensor: &Self::Sensor, contact: &Self::Contact, drive: &Self::Drive, link: &Self::Link) -> Vec<Cost>;
}

impl Set for () {
    type Sensor = ();
    type Contact = ();
    type Drive = ();
    type Link = ();

    fn of(_scene: &Scene, _finger: usize) -> Parts<Self> {
        Parts { sensor: (), contact: (), drive: (), link: () }
    }

    fn costs(_sensor: &(), _contact: &(), _drive: &(), _link: &()) -> Vec<Cost> {
        Vec::new()
    }
}

/// The effects that the scene names.
pub struct Named;

impl Set for Named {
    type Sensor = sensor::Named;
    type Contact = contact::Named;
    type Drive = drive::Named;
    type Link = link::Named;

    fn of(scene: &Scene, finger: usize) -> Parts<Self> {
        let mut parts: Parts<Self> = Parts {
            sensor: sensor::Named::default(),
            contact: contact::Named::default(),
            drive: drive::Named::default(),
            link: link::Named::default(),
        };
        for (name, part) in registry::build(&scene.effects, scene.seed, finger) {
            let rest = parts.sensor.take(name, part).and_then(|part| parts.contact.take(name, part));
            let rest = rest.and_then(|part| parts.drive.take(name, part)).and_then(|part| parts.link.take(name, part));
            assert!(rest.is_none(), "{name} acts at no stage");
        }
        parts
    }

    fn costs(sensor: &sensor::Named, contact: &contact::Named, drive: &drive::Named, link: &link::Named) -> Vec<Cost> {
        sensor.costs().chain(contact.costs()).chain(drive.costs()).chain(link.costs()).collect()
    }
}
