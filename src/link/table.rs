//! The control table: every register defined once, for the device and for its documentation.
//!
//! `table/registers.rs` holds the definition. From it come the addresses as constants ([`address`]), reading and
//! writing here, and [`registers()`], from which `docs/control-table.md` is rendered. Reading puts a register's bytes
//! straight into the reply.

#[macro_use]
mod define;
pub mod indirect;
pub mod mirrors;
mod pictures;
mod registers;
mod values;

pub use define::{Access, COUNT, Kind, Register, registers};
pub use pictures::{COUNT as PICTURES, at as pictures_at};

use super::packet::StatusError;
use super::server::{Counters, Device};
use super::settings::{Actions, Settings};
use super::snapshot::Snapshot;
use super::stand::Stand;
use crate::params::Params;
use crate::pipeline::Taring;
use crate::scan::Clocks;
use crate::state::Limits;
use crate::{capture, measure};
use indirect::Part;

/// Address of each register.
pub mod address {
    pub use super::indirect::address::*;
    pub use super::mirrors::address::*;
    pub use super::registers::address::*;
}

/// Largest number of bytes of a read.
pub const READ_MAX: u16 = 256;

/// The part of a [`Register`] that the device needs.
#[derive(Clone, Copy, Debug)]
struct Cell {
    address: u16,
    /// Address of its value: a different one for a mirror.
    of: u16,
    count: u16,
    kind: Kind,
    access: Access,
}

impl Cell {
    const fn bytes(&self) -> u16 {
        self.kind.width() * self.count
    }

    /// The byte after its last.
    const fn end(&self) -> u16 {
        self.address + self.bytes()
    }

    /// Returns the cell that a byte belongs to; none in a gap.
    fn at<const ROWS: usize, const COLUMNS: usize>(address: u16) -> Option<Self> {
        if let Some(param) = param_place(address) {
            let address = address::PARAMS + 4 * param as u16;
            return Some(Self { address, of: address, count: 1, kind: Kind::I32, access: Access::Stored });
        }
        let holds = |cell: &&Self| address.checked_sub(cell.address).is_some_and(|offset| offset < cell.bytes());
        Self::all::<ROWS, COLUMNS>().find(holds).copied()
    }

    /// Returns the end of the gap that contains a byte.
    fn next<const ROWS: usize, const COLUMNS: usize>(gap: u16) -> u16 {
        let after = Self::all::<ROWS, COLUMNS>().map(|cell| cell.address).chain([address::PARAMS]);
        after.filter(|&address| address > gap).min().unwrap_or(u16::MAX)
    }

    /// Returns all cells but those of the parameters.
    fn all<const ROWS: usize, const COLUMNS: usize>() -> impl Iterator<Item = &'static Self> {
        let pictures = const { &pictures::cells::<ROWS, COLUMNS>() };
        pictures.iter().chain(&registers::CELLS).chain(&indirect::CELLS).chain(&mirrors::CELLS)
    }

    /// Returns the cell of a register from its address.
    const fn of(address: u16) -> Self {
        let Register { kind, count, access, .. } = registers::fixed(address);
        Self { address, of: address, count, kind, access }
    }

    /// Returns the element that a byte belongs to, and the number of bytes of it before that byte.
    fn element(&self, address: u16) -> (u16, u16) {
        let offset = address.saturating_sub(self.address);
        match self.kind.width() {
            1 => (offset, 0),
            2 => (offset / 2, offset % 2),
            _ => (offset / 4, offset % 4),
        }
    }
}

/// Copy that a write changes. It replaces the original once the whole write is valid.
pub(super) struct Staged<const ROWS: usize, const COLUMNS: usize> {
    pub settings: Settings<ROWS, COLUMNS>,
    pub actions: Actions,
    /// State of the loop at the last snapshot.
    pub stand: Stand,
    /// The board's.
    pub clocks: &'static Clocks,
}

/// Refuses a read that is too long, or that goes beyond the table.
pub(super) fn check_read<const ROWS: usize, const COLUMNS: usize>(
    address: u16,
    length: u16,
) -> Result<(), StatusError> {
    if !(1..=READ_MAX).contains(&length) {
        return Err(StatusError::Length);
    }
    let end = const {
        let pictures = pictures::end::<ROWS, COLUMNS>();
        if pictures > registers::END { pictures } else { registers::END }
    };
    address.checked_add(length).filter(|&last| last <= end).map(|_| ()).ok_or(StatusError::Access)
}

/// Sends the bytes of a read that [`check_read`] let through; 0 where there is no register.
pub(super) fn read<const ROWS: usize, const COLUMNS: usize>(
    view: TableView<'_, ROWS, COLUMNS>,
    address: u16,
    length: u16,
    mut put: impl FnMut(u8),
) {
    let end = address.saturating_add(length);
    let mut at = address;
    while at < end {
        let Some(cell) = Cell::at::<ROWS, COLUMNS>(at) else {
            let stop = end.min(Cell::next::<ROWS, COLUMNS>(at));
            (at..stop).for_each(|_| put(0));
            at = stop;
            continue;
        };
        let stop = end.min(cell.address + cell.bytes());
        let width = cell.kind.width();
        while at < stop {
            let (element, skip) = cell.element(at);
            let bytes = match indirect::part(cell.of) {
                Some(Part::Data(first)) => [view.led_to(first, element), 0, 0, 0],
                _ => view.value(&cell, element).to_le_bytes(),
            };
            let take = usize::from(skip)..usize::from(width.min(skip + (stop - at)));
            for &byte in bytes.get(take).unwrap_or_default() {
                put(byte);
                at += 1;
            }
        }
    }
}

/// Writes whole registers side by side into the staged copy.
///
/// # Errors
/// Reason to refuse the first register that is invalid; the copy must then be dropped.
pub(super) fn write<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    address: u16,
    data: &[u8],
) -> Result<(), StatusError> {
    if data.is_empty() {
        return Err(StatusError::Length);
    }
    let before = staged.settings.command;
    let moves = before.torque || staged.stand.strokes(&before);
    let params = staged.settings.record.params;
    let mut at = address;
    let mut rest = data;
    while !rest.is_empty() {
        let cell = Cell::at::<ROWS, COLUMNS>(at).ok_or(StatusError::Access)?;
        let taken = match indirect::part(cell.of) {
            Some(Part::Data(first)) => {
                let element = usize::from(cell.element(at).0);
                let targets = staged.settings.indirect;
                let block = targets.get(first + element..first + indirect::BLOCK).unwrap_or_default();
                write_through::<ROWS, COLUMNS>(staged, block, rest, moves)?
            }
            _ => write_element::<ROWS, COLUMNS>(staged, &cell, at, rest, moves)?,
        };
        rest = rest.get(usize::from(taken)..).ok_or(StatusError::Length)?;
        at = at.saturating_add(taken);
    }
    staged.settings.check(staged.settings.record.params != params, staged.clocks)?;
    staged.stand.check(&before, &staged.settings.command, staged.actions)
}

/// Writes the element that begins at `at`, and returns its number of bytes.
fn write_element<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    cell: &Cell,
    at: u16,
    data: &[u8],
    moves: bool,
) -> Result<u16, StatusError> {
    match cell.access {
        Access::ReadOnly => return Err(StatusError::Access),
        Access::TorqueOff | Access::Stored if moves => return Err(StatusError::Access),
        _ => {}
    }
    let (element, 0) = cell.element(at) else { return Err(StatusError::Length) };
    let value = cell.kind.decode(data).ok_or(StatusError::Length)?;
    if let Some(place) = param_place(cell.of) {
        write_param(&mut staged.settings.record.params, place, value);
    } else if let Some(Part::Address(first)) = indirect::part(cell.of) {
        let target = value as u16;
        indirect::check::<ROWS, COLUMNS>(target)?;
        if let Some(slot) = staged.settings.indirect.get_mut(first + usize::from(element)) {
            *slot = target;
        }
    } else if !pictures::set(staged, cell.of, element, value)? {
        registers::set(staged, cell.of, value)?;
    }
    Ok(cell.kind.width())
}

/// Writes the register that the first of these addresses leads to: the other addresses must lead to the rest of it.
fn write_through<const ROWS: usize, const COLUMNS: usize>(
    staged: &mut Staged<ROWS, COLUMNS>,
    targets: &[u16],
    data: &[u8],
    moves: bool,
) -> Result<u16, StatusError> {
    let target = targets.first().copied().filter(|&target| target != 0).ok_or(StatusError::Access)?;
    let cell = Cell::at::<ROWS, COLUMNS>(target).ok_or(StatusError::Access)?;
    let along = (0..cell.kind.width()).zip(targets).all(|(offset, &next)| next == target.saturating_add(offset));
    if !along || targets.len() < usize::from(cell.kind.width()) {
        return Err(StatusError::Length);
    }
    write_element::<ROWS, COLUMNS>(staged, &cell, target, data, moves)
}

/// Returns the index of the parameter that a byte belongs to.
fn param_place(at: u16) -> Option<usize> {
    let place = usize::from(at.checked_sub(address::PARAMS)?) / 4;
    (place < Params::COUNT).then_some(place)
}

fn write_param(params: &mut Params, place: usize, value: i64) {
    let mut values = params.to_array();
    if let Some(slot) = values.get_mut(place) {
        *slot = value as i32;
    }
    *params = Params::from_array(&values);
}

/// Converts a fixed-point number to thousandths, rounded.
pub(super) const fn thousandths(value: i32, fraction_bits: u32) -> i32 {
    let scaled = value as i64 * 1000;
    ((scaled + (1 << (fraction_bits - 1))) >> fraction_bits) as i32
}

/// Data of a read: the device's own state, and the snapshot of the loop.
#[derive(Clone, Copy)]
pub(in crate::link) struct TableView<'a, const ROWS: usize, const COLUMNS: usize> {
    pub state: &'a Device<ROWS, COLUMNS>,
    pub snapshot: &'a Snapshot<'a, ROWS, COLUMNS>,
}

impl<'a, const ROWS: usize, const COLUMNS: usize> TableView<'a, ROWS, COLUMNS> {
    fn settings(&self) -> &'a Settings<ROWS, COLUMNS> {
        &self.state.settings
    }

    fn tared(&self) -> bool {
        !self.snapshot.status.limits.has(Limits::NOT_TARED)
    }

    fn hindrance(&self) -> u32 {
        let settings = self.settings();
        Stand::of(self.snapshot).hindrance(&settings.record.params, self.state.actions()) as u32
    }

    /// The value of an element of a cell that is not indirect data.
    fn value(&self, cell: &Cell, element: u16) -> u32 {
        if let Some(place) = param_place(cell.of) {
            return self.settings().record.params.to_array().get(place).map_or(0, |&value| value as u32);
        }
        match indirect::part(cell.of) {
            Some(Part::Address(first)) => self.indirect(first, element).into(),
            Some(Part::Data(_)) => 0,
            None => registers::get(*self, cell.of, usize::from(element)),
        }
    }

    fn indirect(&self, first: usize, element: u16) -> u16 {
        self.settings().indirect.get(first + usize::from(element)).copied().unwrap_or(0)
    }

    /// The byte that an indirect address leads to.
    fn led_to(&self, first: usize, element: u16) -> u8 {
        let target = self.indirect(first, element);
        let cell = if target == 0 { None } else { Cell::at::<ROWS, COLUMNS>(target) };
        let byte = cell.and_then(|cell| {
            let (element, skip) = cell.element(target);
            self.value(&cell, element).to_le_bytes().get(usize::from(skip)).copied()
        });
        byte.unwrap_or(0)
    }

    /// Returns the state of the tare. A request that the loop has not acknowledged counts as running: the status
    /// still describes the tare before.
    fn tare_state(&self) -> u32 {
        let status = &self.snapshot.status;
        if self.settings().command.tare_request != status.taken.tare {
            return Taring::Running as u32;
        }
        status.tare as u32
    }

    /// Returns the state of the measurement, with the same rule as the tare's.
    fn measure_state(&self) -> u32 {
        let status = &self.snapshot.status;
        if self.settings().command.measure_request != status.taken.measure {
            return measure::MeasureState::Running as u32;
        }
        status.measure.state as u32
    }

    /// Returns the state of the capture, where a new request counts already.
    fn capture_state(&self) -> u32 {
        let state = self.snapshot.capture.standing.state;
        if self.state.actions().capture == Some(true) { capture::CaptureState::Armed as u32 } else { state as u32 }
    }

    /// A byte of the capture.
    fn captured(&self, element: usize) -> u8 {
        let offset = self.settings().capture_offset as usize;
        let byte = offset.checked_add(element).and_then(|place| self.snapshot.capture.data.get(place));
        byte.copied().unwrap_or(0)
    }

    fn refused(&self, error: StatusError) -> u32 {
        u32::from(self.state.counters.refused(error))
    }

    fn counters(&self) -> &'a Counters {
        &self.state.counters
    }
}
