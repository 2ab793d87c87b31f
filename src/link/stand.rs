//! How the loop stands to what the host asks, and what can therefore not be carried out.
//!
//! The link knows the loop by a snapshot that may be a frame old, and by what it has itself let through since. A
//! request that is impossible by these is refused with the result error. What comes in between, as a fault in the next
//! frame, shows in the registers `tare_state`, `measure_state` and `saved_state`.

use crate::capture;
use crate::command::Command;
use crate::measure::Task;
use crate::params::Params;
use crate::pipeline::Taken;
use crate::state::{Fault, Limits, Mode};
use crate::units::Newtons;

use super::packet::StatusError;
use super::settings::Actions;
use super::snapshot::Snapshot;

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
    tared_touching: bool,
    supply_mv: u16,
    bad_taxels: u8,
    /// Frames are being kept for a capture.
    pub captures: bool,
}

/// What stands in the way of recovering from a fault: it would be back at once. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Hindrance {
    None = 0,
    SupplyLow = 1,
    SupplyHigh = 2,
    BadTaxels = 3,
    SaveWaits = 4,
}

impl Stand {
    /// As a snapshot shows it.
    pub fn of<const ROWS: usize, const COLUMNS: usize>(snapshot: &Snapshot<'_, ROWS, COLUMNS>) -> Self {
        let status = &snapshot.status;
        Self {
            faulted: status.fault.is_some(),
            bus_silent: status.fault == Some(Fault::BusSilent),
            taken: status.taken,
            mode: status.mode,
            tared: !status.limits.has(Limits::NOT_TARED),
            tared_touching: status.limits.has(Limits::TARED_TOUCHING),
            supply_mv: snapshot.supply_mv,
            bad_taxels: status.contact.bad_taxels,
            captures: snapshot.capture.standing.state == capture::State::Recording,
        }
    }

    /// What stands in the way of recovering from a fault.
    pub fn hindrance(&self, params: &Params, actions: Actions) -> Hindrance {
        let supply_mv = i32::from(self.supply_mv);
        if supply_mv < params.supply_min_mv {
            Hindrance::SupplyLow
        } else if supply_mv > params.supply_max_mv {
            Hindrance::SupplyHigh
        } else if i32::from(self.bad_taxels) > params.bad_taxels_max {
            Hindrance::BadTaxels
        } else if actions.save {
            Hindrance::SaveWaits
        } else {
            Hindrance::None
        }
    }

    /// Whether a tare is under way, or about to be.
    fn taring(&self, command: &Command) -> bool {
        self.mode == Mode::Tare || command.tare_request != self.taken.tare
    }

    /// Whether torque may be enabled: a tare is under way, which torque waits for, or is done; and nothing touched the tip
    /// in it, or that was forced.
    pub fn zeroed(&self, command: &Command) -> bool {
        self.taring(command) || self.tared && (command.tare_forced || !self.tared_touching)
    }

    /// Whether the motor jogs or makes strokes, or is about to.
    pub fn strokes(&self, command: &Command) -> bool {
        let waits = command.measure_request != self.taken.measure;
        self.mode == Mode::Strokes || waits && matches!(Task::of(command.measure_request), Task::Jog | Task::Strokes)
    }

    /// Refuses what a write asks for and what cannot be done.
    ///
    /// # Errors
    /// A goal above 0 in a fault, which lets go; a tare in one that is not to be cleared; a press without torque or tare;
    /// a jog or strokes with torque, in a fault or without a tare; a save while the loop drives, is about to or tares,
    /// when it must not wait for the flash.
    pub fn check(&self, before: &Command, after: &Command, actions: Actions) -> Result<(), StatusError> {
        let goal = after.goal == Newtons::ZERO || !self.faulted;
        let stopped = self.faulted && after.clear_request == self.taken.clear;
        let taring = self.taring(after);
        let tare = after.tare_request == before.tare_request || !stopped;
        let measure = after.measure_request == before.measure_request
            || match Task::of(after.measure_request) {
                Task::Stop => true,
                Task::Press => after.torque && (self.tared || taring),
                Task::Jog | Task::Strokes => !after.torque && self.tared && !taring && !self.faulted,
            };
        let moves = self.strokes(after);
        let save = !actions.save || !after.torque && !taring && !moves && matches!(self.mode, Mode::Off | Mode::Fault);
        if goal && tare && measure && save { Ok(()) } else { Err(StatusError::Result) }
    }
}
