//! How the loop stands to what the host asks, and what can therefore not be carried out.
//!
//! The link knows the loop by a snapshot that may be a frame old, and by what it has itself let through since. A
//! request that is impossible by these is refused with the result error. What comes in between, as a fault in the next
//! frame, shows in the registers `tare_state`, `identify_state` and `saved_state`.

use crate::command::Command;
use crate::pipeline::{Status, Taken};
use crate::state::{Fault, Limits, Mode};
use crate::units::Newtons;

use super::packet::StatusError;
use super::settings::Actions;

/// What the last snapshot told.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stand {
    /// A fault stands.
    pub faulted: bool,
    /// It is that of the bus watchdog.
    pub bus_silent: bool,
    taken: Taken,
    mode: Mode,
    tared: bool,
}

impl Stand {
    /// As a status shows it.
    pub fn of(status: &Status) -> Self {
        Self {
            faulted: status.fault.is_some(),
            bus_silent: status.fault == Some(Fault::BusSilent),
            taken: status.taken,
            mode: status.mode,
            tared: !status.limits.has(Limits::NOT_TARED),
        }
    }

    /// Refuses what a write asks for and what cannot be done.
    ///
    /// # Errors
    /// A goal above 0 in a fault, which lets go; a tare in one that is not to be cleared; a measurement of the modulus
    /// without torque or tare; a save while the loop drives, is about to or tares, when it must not wait for the flash.
    pub fn check(&self, before: &Command, after: &Command, actions: Actions) -> Result<(), StatusError> {
        let goal = after.goal == Newtons::ZERO || !self.faulted;
        let stopped = self.faulted && after.clear_request == self.taken.clear;
        let taring = self.mode == Mode::Tare || after.tare_request != self.taken.tare;
        let tare = after.tare_request == before.tare_request || !stopped;
        let identify = after.identify_request == before.identify_request || after.torque && (self.tared || taring);
        let save = !actions.save || !after.torque && !taring && matches!(self.mode, Mode::Off | Mode::Fault);
        if goal && tare && identify && save { Ok(()) } else { Err(StatusError::Result) }
    }
}
