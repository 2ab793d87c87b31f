//! State of the loop at the last snapshot, and the requests that cannot be carried out in it.
//!
//! The link knows the loop by a snapshot that may be a frame old, and by what it has itself let through since. A
//! request that is impossible by these is refused with the result error. What comes in between, as a fault in the next
//! frame, shows in the registers `tare_state`, `measure_state` and `saved_state`.

use crate::capture;
use crate::command::Command;
use crate::measure::Task;
use crate::params::Params;
use crate::pipeline::AcknowledgedRequests;
use crate::state::{Fault, Limits, Mode};
use crate::units::Newtons;

use super::packet::StatusError;
use super::settings::Actions;
use super::snapshot::Snapshot;

/// State of the loop at the last snapshot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stand {
    /// True in a fault.
    pub faulted: bool,
    /// True if it is the fault of the bus watchdog.
    pub bus_silent: bool,
    taken: AcknowledgedRequests,
    mode: Mode,
    tared: bool,
    tared_touching: bool,
    supply_mv: u16,
    bad_taxels: u8,
    /// True while frames are being kept for a capture.
    pub captures: bool,
}

/// Obstacle to a recovery from a fault, which would return at once. The numbers are stable.
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
    /// Returns the state that a snapshot shows.
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
            captures: snapshot.capture.standing.state == capture::CaptureState::Recording,
        }
    }

    /// Returns the obstacle to a recovery from a fault.
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

    /// Returns true if a tare is under way, or about to be.
    fn taring(&self, command: &Command) -> bool {
        self.mode == Mode::Tare || command.tare_request != self.taken.tare
    }

    /// Returns true if torque may be enabled: a tare is under way, for which torque waits, or is done; and nothing
    /// touched the tip in it, or it was forced.
    pub fn zeroed(&self, command: &Command) -> bool {
        self.taring(command) || self.tared && (command.tare_forced || !self.tared_touching)
    }

    /// Returns true if the motor jogs or makes strokes, or is about to.
    pub fn strokes(&self, command: &Command) -> bool {
        let waits = command.measure_request != self.taken.measure;
        self.mode == Mode::Strokes || waits && matches!(Task::of(command.measure_request), Task::Jog | Task::Strokes)
    }

    /// Refuses requests of a write that cannot be carried out.
    ///
    /// # Errors
    /// A goal above 0 in a fault, which releases the object. A tare in a fault that this write does not clear. A press
    /// without torque or tare. A jog or strokes with torque, in a fault or without a tare. A save while the loop
    /// drives, is about to or tares, when it must not wait for the flash.
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
