//! Clocks, electronics, bus and host.

mod named;

use super::{Metered, Part};
use crate::registry::Description;
use crate::watch::Cost;

/// The effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[&Description] =
    &[&named::CLOCK_TOLERANCE, &named::BURST, &named::HOST_JITTER, &named::LOST_PACKETS, &named::CORRUPTED_PACKETS];

/// Acts on the controller's clock: how long a second of it lasts in the world, s, from this time on, s.
pub type Clock = dyn FnMut(f64) -> f64 + Send;

/// Acts on the packets from the host to the controller: when one sent at a time arrives, both in s; none where it does
/// not.
pub type Packets = dyn FnMut(f64) -> Option<f64> + Send;

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

named! {
    Clock(clock: Clock),
    Packets(packets: Packets),
}

impl Stages for Named {
    #[inline]
    fn second_s(&mut self, time_s: f64) -> f64 {
        self.clock.iter_mut().map(|effect| effect.call(|part| part(time_s))).product()
    }

    fn pass(&mut self, sent_s: f64) -> Option<f64> {
        self.packets.iter_mut().try_fold(sent_s, |sent_s, effect| effect.call(|part| part(sent_s)))
    }
}
