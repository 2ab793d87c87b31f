//! Registers whose values take more than a line to read or to write.

use super::{Staged, TableView};
use crate::config::newtons;
use crate::link::checks::Hindrance;
use crate::link::packet::StatusError;
use crate::link::settings::Settings;
use crate::measure::{MeasureState, Task};
use crate::pipeline::{Status, Taring};
use crate::state::Limits;
use crate::units::{Duty, Newtons};
use fixed::types::{I8F24, I16F16};

/// The bus watchdog's unit.
const WATCHDOG_MS: u16 = 20;

impl<const ROWS: usize, const COLUMNS: usize> Staged<'_, ROWS, COLUMNS> {
    /// Sets torque enable. On is refused in a fault, after a tripped watchdog, with an unconfirmed motor direction,
    /// before a tare, and after a tare during which something touched the tip. Off sets the goal to 0.
    pub(super) fn set_torque(&mut self, value: i64) -> Result<(), StatusError> {
        let on = value != 0;
        let unconfirmed = self.settings.record.params.direction_confirmed == 0;
        if on && (self.settings.watchdog_tripped || self.snapshot.faulted() || unconfirmed || !self.zeroed()) {
            return Err(StatusError::Result);
        }
        self.settings.command.torque = on;
        if !on {
            self.take_goal(Newtons::ZERO);
        }
        Ok(())
    }

    /// Requests a tare: 2 forces torque to be allowed after it.
    pub(super) fn set_tare(&mut self, value: i64) -> Result<(), StatusError> {
        let command = &mut self.settings.command;
        bump(&mut command.tare_request, value);
        command.tare_forced = value == 2 || value == 0 && command.tare_forced;
        Ok(())
    }

    /// Requests a task of a measurement. A motion is refused while another one runs or waits, or its end waits.
    pub(super) fn set_measure(&mut self, value: i64) -> Result<(), StatusError> {
        let task = Task::of(value as u8);
        if task == Task::Stop {
            self.stop_measure();
            return Ok(());
        }
        // Its record needs the memory of a capture.
        let kept = task != Task::Jog && (self.snapshot.captures() || self.actions.capture == Some(true));
        if self.settings.watchdog_tripped || self.measures() || kept {
            return Err(StatusError::Result);
        }
        let command = &mut self.settings.command;
        command.measure_request = task.after(command.measure_request);
        Ok(())
    }

    /// Requests the end of a motion that measures, unless none runs or that was the last request anyway.
    fn stop_measure(&mut self) {
        self.stops = true;
        let measures = self.measures();
        let request = &mut self.settings.command.measure_request;
        if measures && Task::of(*request) != Task::Stop {
            *request = Task::Stop.after(*request);
        }
    }

    /// Sets the goal force: above 0 it is refused until a tripped watchdog is reset.
    pub(super) fn set_goal(&mut self, value: i64) -> Result<(), StatusError> {
        if self.settings.watchdog_tripped && value != 0 {
            return Err(StatusError::Range);
        }
        self.take_goal(newtons(value as i32));
        Ok(())
    }

    /// A goal of 0 also ends a motion that measures. The loop may not see torque off, if on follows at once.
    fn take_goal(&mut self, goal: Newtons) {
        self.settings.command.goal = goal;
        if goal == Newtons::ZERO {
            self.stop_measure();
        }
    }

    /// Sets the bus watchdog: 0 resets a tripped one.
    pub(super) fn set_watchdog(&mut self, value: i64) -> Result<(), StatusError> {
        if self.settings.watchdog_tripped && value != 0 {
            return Err(StatusError::Range);
        }
        self.settings.watchdog_tripped = false;
        self.settings.command.bus_watchdog_ms = value as u16 * WATCHDOG_MS;
        Ok(())
    }

    /// Recovers: a tripped watchdog, torque, goal and fault in one.
    pub(super) fn set_recover(&mut self, value: i64) -> Result<(), StatusError> {
        if value == 0 || !self.snapshot.faulted() && !self.settings.watchdog_tripped {
            return Ok(());
        }
        if self.snapshot.hindrance(&self.settings.record.params, self.actions) != Hindrance::None {
            return Err(StatusError::Result);
        }
        if self.settings.watchdog_tripped {
            self.set_watchdog(0)?;
        }
        self.set_torque(0)?;
        bump(&mut self.settings.command.clear_request, 1);
        Ok(())
    }

    /// Arms the capture, or ends it. Refused while a motion that measures runs or waits: its record needs the memory.
    pub(super) fn set_capture(&mut self, value: i64) -> Result<(), StatusError> {
        let arm = value != 0;
        if arm && self.settings.command.torque {
            return Err(StatusError::Access);
        }
        if arm && (self.snapshot.records() || self.measures()) {
            return Err(StatusError::Result);
        }
        self.actions.capture = Some(arm);
        Ok(())
    }
}

impl<'a, const ROWS: usize, const COLUMNS: usize> TableView<'a, ROWS, COLUMNS> {
    pub(super) fn settings(&self) -> &'a Settings<ROWS, COLUMNS> {
        &self.state.settings
    }

    pub(super) fn status(&self) -> &'a Status {
        &self.snapshot.status
    }

    pub(super) fn tared(&self) -> bool {
        !self.status().limits.has(Limits::NOT_TARED)
    }

    pub(super) fn hindrance(&self) -> u32 {
        self.snapshot.hindrance(&self.settings().record.params, self.state.actions) as u32
    }

    pub(super) fn watchdog(&self) -> u32 {
        let settings = self.settings();
        if settings.watchdog_tripped { u32::MAX } else { u32::from(settings.command.bus_watchdog_ms / WATCHDOG_MS) }
    }

    /// Returns the state of the tare. A request that the loop has not acknowledged counts as running: the status
    /// still describes the previous tare.
    pub(super) fn tare_state(&self) -> u32 {
        let waits = self.settings().command.tare_request != self.status().taken.tare;
        if waits { Taring::Running as u32 } else { self.status().tare as u32 }
    }

    /// Returns the state of the measurement, with the same rule as the tare's.
    pub(super) fn measure_state(&self) -> u32 {
        let waits = self.settings().command.measure_request != self.status().taken.measure;
        if waits { MeasureState::Running as u32 } else { self.status().measure.state as u32 }
    }

    /// Returns a byte of the capture.
    pub(super) fn captured(&self, element: usize) -> u8 {
        let place = (self.settings().capture_offset as usize).checked_add(element);
        place.and_then(|place| self.snapshot.capture.data.get(place)).copied().unwrap_or(0)
    }

    pub(super) fn refused(&self, error: StatusError) -> u32 {
        self.state.counters.refused(error).into()
    }
}

/// Makes a request by changing its number, unless 0 was written.
pub(super) fn bump(request: &mut u8, value: i64) {
    *request = request.wrapping_add(u8::from(value != 0));
}

/// Returns thousandths of a number, rounded.
pub(in crate::link) fn milli(value: I16F16) -> u32 {
    thousandths(value.to_bits(), 16)
}

/// Returns micrometres of a length in mm, rounded.
pub(super) fn micro(value: I8F24) -> u32 {
    thousandths(value.to_bits(), 24)
}

#[inline(never)]
fn thousandths(value: i32, fraction_bits: u32) -> u32 {
    let scaled = i64::from(value) * 1000;
    ((scaled + (1 << (fraction_bits - 1))) >> fraction_bits) as u32
}

/// Returns the low bytes of a number of 16 bits, held at its ends.
pub(super) fn short(value: u32) -> u32 {
    value.cast_signed().max(i16::MIN.into()).min(i16::MAX.into()) as u32
}

/// Returns a duty in thousandths of the supply, rounded.
pub(super) fn permille(duty: Duty) -> i32 {
    let full = i32::from(Duty::FULL);
    let duty = i32::from(duty.0);
    (duty * 1000 + duty.signum() * (full / 2)) / full
}
