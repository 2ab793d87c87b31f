//! Requests that cannot be carried out in the present state of the loop, and settings that contradict each other.
//!
//! The link knows the loop by a snapshot that may be a frame old, and by what it has itself let through since. A
//! request that is impossible by these is refused with the result error. What comes in between, as a fault in the next
//! frame, shows in the registers `tare_state`, `measure_state` and `saved_state`.

use super::packet::StatusError;
use super::settings::{Actions, Settings};
use super::snapshot::Snapshot;
use super::table::{Staged, milli};
use crate::capture::CaptureState;
use crate::config::{ConfigError, Shaped};
use crate::measure::{MeasureState, Task};
use crate::params::Params;
use crate::state::{Limits, Mode};
use crate::units::Newtons;

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

impl<const ROWS: usize, const COLUMNS: usize> Snapshot<'_, ROWS, COLUMNS> {
    /// Returns true in a fault.
    pub(super) fn faulted(&self) -> bool {
        self.status.fault.is_some()
    }

    /// Returns true while frames are being kept for a capture.
    pub(super) fn records(&self) -> bool {
        self.capture.standing.state == CaptureState::Recording
    }

    /// Returns true while a capture waits for its tare, or keeps frames.
    pub(super) fn captures(&self) -> bool {
        self.records() || self.capture.standing.state == CaptureState::Armed
    }

    /// Returns the obstacle to a recovery from a fault.
    pub(super) fn hindrance(&self, params: &Params, actions: Actions) -> Hindrance {
        let supply_mv = i32::from(self.supply_mv);
        if supply_mv < params.supply_min_mv {
            Hindrance::SupplyLow
        } else if supply_mv > params.supply_max_mv {
            Hindrance::SupplyHigh
        } else if i32::from(self.status.contact.bad_taxels) > params.bad_taxels_max {
            Hindrance::BadTaxels
        } else if actions.save {
            Hindrance::SaveWaits
        } else {
            Hindrance::None
        }
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Staged<'_, ROWS, COLUMNS> {
    /// Returns true if a tare is under way, or about to be.
    fn taring(&self) -> bool {
        let status = &self.snapshot.status;
        status.mode == Mode::Tare || self.settings.command.tare_request != status.taken.tare
    }

    /// Returns true if torque may be enabled: a tare is under way, for which torque waits, or is done; and nothing
    /// touched the tip in it, or it was forced.
    pub fn zeroed(&self) -> bool {
        let limits = self.snapshot.status.limits;
        let touched = limits.has(Limits::TARED_TOUCHING) && !self.settings.command.tare_forced;
        self.taring() || !limits.has(Limits::NOT_TARED) && !touched
    }

    /// Returns true if the loop has not taken the last request for a motion that measures, or for its end.
    pub fn measure_waits(&self) -> bool {
        self.settings.command.measure_request != self.snapshot.status.taken.measure
    }

    /// Returns true while a motion that measures runs, or a request for one or for its end waits.
    pub fn measures(&self) -> bool {
        self.measure_waits() || self.snapshot.status.measure.state == MeasureState::Running
    }

    /// Returns true if the motor jogs or makes strokes, or is about to.
    pub fn strokes(&self) -> bool {
        let requested = || matches!(Task::of(self.settings.command.measure_request), Task::Jog | Task::Strokes);
        self.snapshot.status.mode == Mode::Strokes || self.measure_waits() && requested()
    }

    /// Returns true if the motor is driven, or is about to be.
    pub fn moves(&self) -> bool {
        self.settings.command.torque || self.strokes()
    }

    /// Refuses settings that no register's own range can refuse, and requests that cannot be carried out: a goal above
    /// 0 without torque, as in a fault; a tare in a fault that is not cleared; a press without torque or tare; a jog or
    /// strokes with torque, in a fault or without a tare; and a save while the loop drives, is about to or tares, when
    /// it must not wait for the flash.
    pub fn check(&self, before: &Settings<ROWS, COLUMNS>) -> Result<(), StatusError> {
        let Settings { record, command, .. } = &self.settings;
        if record.params != before.record.params {
            Shaped::<ROWS, COLUMNS>::new(&record.params, self.clocks).map_err(|error| match error {
                ConfigError::Param(_) => StatusError::Range,
                _ => StatusError::Limit,
            })?;
        }
        if milli(command.goal.0).cast_signed() > record.params.force_max_mn {
            return Err(StatusError::Limit);
        }
        let (status, faulted, taring) = (&self.snapshot.status, self.snapshot.faulted(), self.taring());
        let tared = !status.limits.has(Limits::NOT_TARED);
        // Torque off in the same write counts, and takes the goal back: a driver may repeat its goal.
        let goal = command.goal == Newtons::ZERO || command.torque || before.command.torque;
        let stopped = faulted && command.clear_request == status.taken.clear;
        let tare = command.tare_request == before.command.tare_request || !stopped;
        let measure = command.measure_request == before.command.measure_request
            || match Task::of(command.measure_request) {
                Task::Stop => true,
                Task::Press => command.torque && (tared || taring),
                Task::Jog | Task::Strokes => !command.torque && tared && !taring && !faulted,
            };
        let save = !self.actions.save || !self.moves() && !taring && matches!(status.mode, Mode::Off | Mode::Fault);
        if goal && tare && measure && save { Ok(()) } else { Err(StatusError::Result) }
    }
}
