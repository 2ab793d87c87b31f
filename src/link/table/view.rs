//! What a read sees: the device's own state, and the picture of the loop.

use crate::capture;
use crate::link::packet::StatusError;
use crate::link::server::{Counters, Device};
use crate::link::settings::Settings;
use crate::link::snapshot::Snapshot;
use crate::link::stand::Stand;
use crate::measure;
use crate::pipeline::Taring;
use crate::state::Limits;

use super::indirect::{self, Part};
use super::{Cell, param_place, registers};

/// What a read sees.
#[derive(Clone, Copy)]
pub(in crate::link) struct View<'a, const ROWS: usize, const COLUMNS: usize> {
    pub state: &'a Device<ROWS, COLUMNS>,
    pub snapshot: &'a Snapshot<'a, ROWS, COLUMNS>,
}

impl<'a, const ROWS: usize, const COLUMNS: usize> View<'a, ROWS, COLUMNS> {
    pub(super) fn settings(&self) -> &'a Settings<ROWS, COLUMNS> {
        &self.state.settings
    }

    pub(super) fn tared(&self) -> bool {
        !self.snapshot.status.limits.has(Limits::NOT_TARED)
    }

    pub(super) fn hindrance(&self) -> u32 {
        let settings = self.settings();
        Stand::of(self.snapshot).hindrance(&settings.record.params, self.state.actions()) as u32
    }

    /// The value of an element of a cell that is not indirect data.
    pub(super) fn value(&self, cell: &Cell, element: u16) -> u32 {
        if let Some(place) = param_place(cell.of) {
            return self.settings().record.params.to_array().get(place).map_or(0, |&value| value as u32);
        }
        match indirect::part(cell.of) {
            Some(Part::Address(first)) => self.indirect(first, element).into(),
            Some(Part::Data(_)) => 0,
            None => registers::get(*self, cell.of, usize::from(element)),
        }
    }

    pub(super) fn indirect(&self, first: usize, element: u16) -> u16 {
        self.settings().indirect.get(first + usize::from(element)).copied().unwrap_or(0)
    }

    /// The byte that an indirect address leads to.
    pub(super) fn led_to(&self, first: usize, element: u16) -> u8 {
        let target = self.indirect(first, element);
        let cell = if target == 0 { None } else { Cell::at::<ROWS, COLUMNS>(target) };
        let byte = cell.and_then(|cell| {
            let (element, skip) = cell.element(target);
            self.value(&cell, element).to_le_bytes().get(usize::from(skip)).copied()
        });
        byte.unwrap_or(0)
    }

    /// A request that the loop has not yet taken up counts as running: what its status tells of is the one before.
    pub(super) fn tare_state(&self) -> u32 {
        let status = &self.snapshot.status;
        if self.settings().command.tare_request != status.taken.tare {
            return Taring::Running as u32;
        }
        status.tare as u32
    }

    /// As the tare's.
    pub(super) fn measure_state(&self) -> u32 {
        let status = &self.snapshot.status;
        if self.settings().command.measure_request != status.taken.measure {
            return measure::State::Running as u32;
        }
        status.measure.state as u32
    }

    /// As the tare's: what was asked for counts already.
    pub(super) fn capture_state(&self) -> u32 {
        let state = self.snapshot.capture.standing.state;
        if self.state.actions().capture == Some(true) { capture::State::Armed as u32 } else { state as u32 }
    }

    /// A byte of the capture.
    pub(super) fn captured(&self, element: usize) -> u8 {
        let offset = self.settings().capture_offset as usize;
        let byte = offset.checked_add(element).and_then(|place| self.snapshot.capture.data.get(place));
        byte.copied().unwrap_or(0)
    }

    pub(super) fn refused(&self, error: StatusError) -> u32 {
        u32::from(self.state.counters.refused(error))
    }

    pub(super) fn counters(&self) -> &'a Counters {
        &self.state.counters
    }
}
