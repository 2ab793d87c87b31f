//! Clocks, electronics, bus and host.

mod burst;
mod clock_tolerance;
mod corrupted_packets;
mod host_jitter;
mod lost_packets;

use super::{Metered, Part};
use crate::registry::Description;
use crate::watch::Cost;

/// The effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[&Description] = &[
    &clock_tolerance::EFFECT,
    &burst::EFFECT,
    &host_jitter::EFFECT,
    &lost_packets::EFFECT,
    &corrupted_packets::EFFECT,
];

/// Acts on the controller's clock.
pub trait Clock: Send {
    /// How long a second of the controller lasts in the world, from this time on.
    fn second_s(&mut self, time_s: f64) -> f64;
}

/// Acts on the packets from the host to the controller.
pub trait Packets: Send {
    /// When a packet sent at a time arrives; none where it does not.
    fn pass(&mut self, sent_s: f64) -> Option<f64>;
}

/// The stages as the board and the host call them: of the named effects, or `()`, in which none is compiled.
pub trait Stages {
    /// How long a second of the controller lasts in the world.
    fn second_s(&mut self, _time_s: f64) -> f64 {
        1.0
    }

    /// When a packet sent at a time arrives; none where it does not.
    fn pass(&mut self, sent_s: f64) -> Option<f64> {
        Some(sent_s)
    }
}

impl Stages for () {}

/// The named effects.
#[derive(Default)]
pub struct Named {
    clock: Vec<Metered<dyn Clock>>,
    packets: Vec<Metered<dyn Packets>>,
}

impl Named {
    /// Takes an effect in behind those that are there; gives back what belongs elsewhere.
    pub fn take(&mut self, name: &'static str, part: Part) -> Option<Part> {
        match part {
            Part::Clock(part) => self.clock.push(Metered::new(name, part)),
            Part::Packets(part) => self.packets.push(Metered::new(name, part)),
            other => return Some(other),
        }
        None
    }

    /// What each has cost so far.
    pub fn costs(&self) -> impl Iterator<Item = Cost> {
        self.clock.iter().map(Metered::cost).chain(self.packets.iter().map(Metered::cost))
    }
}

impl Stages for Named {
    #[inline]
    fn second_s(&mut self, time_s: f64) -> f64 {
        self.clock.iter_mut().map(|effect| effect.call(|part| part.second_s(time_s))).product()
    }

    fn pass(&mut self, sent_s: f64) -> Option<f64> {
        self.packets.iter_mut().try_fold(sent_s, |sent_s, effect| effect.call(|part| part.pass(sent_s)))
    }
}
