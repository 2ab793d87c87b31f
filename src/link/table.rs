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
pub(super) use values::milli;

use super::packet::StatusError;
use super::server::Device;
use super::settings::{Actions, Settings};
use super::snapshot::Snapshot;
use crate::params::Params;
use crate::scan::Clocks;
use registers::Source;

/// Address of each register.
pub mod address {
    pub use super::indirect::address::*;
    pub use super::mirrors::address::*;
    pub use super::registers::address::*;
}

/// Largest number of bytes of a read.
pub const READ_MAX: u16 = 256;

/// The part of a [`Register`] that the device needs. All parameters are one cell.
#[derive(Clone, Copy, Debug)]
struct Cell {
    address: u16,
    count: u16,
    kind: Kind,
    access: Access,
    source: Source,
}

const CELLS: usize = COUNT + 1 - Params::COUNT;

/// Cells of an array's table, in the order of the addresses.
const fn cells<const ROWS: usize, const COLUMNS: usize>() -> [Cell; CELLS] {
    let registers = registers::<ROWS, COLUMNS>();
    let mut cells = [Cell::of(&registers[0]); CELLS];
    let (mut place, mut count) = (0, 0);
    while place < COUNT {
        let cell = Cell::of(&registers[place]);
        if matches!(cell.source, Source::Params) && cell.address > address::PARAMS {
            cells[count - 1].count += 1;
        } else {
            cells[count] = cell;
            count += 1;
        }
        place += 1;
    }
    cells
}

impl Cell {
    const fn of(register: &Register) -> Self {
        let Register { address, count, kind, access, source, .. } = *register;
        Self { address, count, kind, access, source }
    }

    /// The byte after its last.
    const fn end(&self) -> u16 {
        self.address + self.kind.width() * self.count
    }

    /// Returns the cell that a byte belongs to, or the end of the gap that contains it.
    fn at<const ROWS: usize, const COLUMNS: usize>(address: u16) -> Result<Self, u16> {
        let cells = const { &cells::<ROWS, COLUMNS>() };
        let (before, after) = cells.split_at(cells.partition_point(|cell| cell.address <= address));
        let cell = before.last().copied().filter(|cell| address < cell.end());
        cell.ok_or_else(|| after.first().map_or(u16::MAX, |cell| cell.address))
    }

    /// Returns the element that a byte belongs to, and the number of bytes of it before that byte.
    fn element(&self, address: u16) -> (usize, u16) {
        let (offset, width) = (address.saturating_sub(self.address), self.kind.width());
        (usize::from(offset >> width.trailing_zeros()), offset & (width - 1))
    }
}

/// Refuses a read that is too long, or that goes beyond the table.
pub(super) fn check_read<const ROWS: usize, const COLUMNS: usize>(
    address: u16,
    length: u16,
) -> Result<(), StatusError> {
    if !(1..=READ_MAX).contains(&length) {
        return Err(StatusError::Length);
    }
    let end = const { cells::<ROWS, COLUMNS>()[CELLS - 1].end() };
    address.checked_add(length).filter(|&last| last <= end).map(|_| ()).ok_or(StatusError::Access)
}

/// Copy that a write changes. It replaces the original once the whole write is valid.
pub(super) struct Staged<'a, const ROWS: usize, const COLUMNS: usize> {
    pub settings: Settings<ROWS, COLUMNS>,
    pub actions: Actions,
    /// True once a goal of 0, torque off, `measure` 0 or `recover` was written: a write that waits for its Action is dropped.
    pub stops: bool,
    pub snapshot: &'a Snapshot<'a, ROWS, COLUMNS>,
    /// Clocks of the board, which bound some parameters.
    pub clocks: &'static Clocks,
}

impl<const ROWS: usize, const COLUMNS: usize> Staged<'_, ROWS, COLUMNS> {
    /// Writes whole registers side by side. After an error the copy must be dropped.
    pub fn write(&mut self, address: u16, data: &[u8]) -> Result<(), StatusError> {
        if data.is_empty() {
            return Err(StatusError::Length);
        }
        let moves = self.moves();
        let (mut at, mut rest) = (address, data);
        while !rest.is_empty() {
            let cell = Cell::at::<ROWS, COLUMNS>(at).map_err(|_| StatusError::Access)?;
            let taken = match cell.source {
                Source::Data(first) => self.write_through(usize::from(first), cell.element(at).0, rest, moves)?,
                _ => self.write_element(&cell, at, rest, moves)?,
            };
            rest = rest.get(usize::from(taken)..).ok_or(StatusError::Length)?;
            at = at.saturating_add(taken);
        }
        Ok(())
    }

    /// Writes the element that begins at `at`, and returns its number of bytes.
    fn write_element(&mut self, cell: &Cell, at: u16, data: &[u8], moves: bool) -> Result<u16, StatusError> {
        match cell.access {
            Access::ReadOnly => return Err(StatusError::Access),
            Access::TorqueOff | Access::Stored if moves => return Err(StatusError::Access),
            _ => {}
        }
        let (element, 0) = cell.element(at) else { return Err(StatusError::Length) };
        let value = cell.kind.decode(data).ok_or(StatusError::Length)?;
        match cell.source {
            Source::Params => {
                let mut values = self.settings.record.params.to_array();
                if let Some(slot) = values.get_mut(element) {
                    *slot = value as i32;
                }
                self.settings.record.params = Params::from_array(&values);
            }
            Source::Addresses(first) => {
                let target = value as u16;
                let leads = |cell: Cell| !matches!(cell.source, Source::Addresses(_) | Source::Data(_));
                if target != 0 && (target < indirect::TARGET_MIN || !Cell::at::<ROWS, COLUMNS>(target).is_ok_and(leads))
                {
                    return Err(StatusError::Range);
                }
                if let Some(slot) = self.settings.indirect.get_mut(usize::from(first) + element) {
                    *slot = target;
                }
            }
            Source::Gains => {
                let gains = &mut self.settings.record.gains;
                if !u16::try_from(value).is_ok_and(|gain| gains.set(element, gain)) {
                    return Err(StatusError::Range);
                }
            }
            source => self.set_register(source, value)?,
        }
        Ok(cell.kind.width())
    }

    /// Writes the register that the first address from this element of a block on leads to: the other addresses must
    /// lead to the rest of it.
    fn write_through(&mut self, first: usize, element: usize, data: &[u8], moves: bool) -> Result<u16, StatusError> {
        let addresses = self.settings.indirect;
        let targets = addresses.get(first + element..first + indirect::BLOCK).unwrap_or_default();
        let target = targets.first().copied().filter(|&target| target != 0).ok_or(StatusError::Access)?;
        let cell = Cell::at::<ROWS, COLUMNS>(target).map_err(|_| StatusError::Access)?;
        let along = (0..cell.kind.width()).zip(targets).all(|(offset, &next)| next == target.saturating_add(offset));
        if !along || targets.len() < usize::from(cell.kind.width()) {
            return Err(StatusError::Length);
        }
        self.write_element(&cell, target, data, moves)
    }
}

/// Data of a read: the device's own state, and the snapshot of the loop.
pub(super) struct TableView<'a, const ROWS: usize, const COLUMNS: usize> {
    pub state: &'a Device<ROWS, COLUMNS>,
    pub snapshot: &'a Snapshot<'a, ROWS, COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> TableView<'_, ROWS, COLUMNS> {
    /// Sends the bytes of a read that [`check_read`] let through; 0 where there is no register.
    pub fn read(&self, address: u16, length: u16, put: &mut dyn FnMut(u8)) {
        let end = address.saturating_add(length);
        let mut at = address;
        while at < end {
            let cell = match Cell::at::<ROWS, COLUMNS>(at) {
                Ok(cell) => cell,
                Err(next) => {
                    let stop = end.min(next);
                    (at..stop).for_each(|_| put(0));
                    at = stop;
                    continue;
                }
            };
            let (stop, width) = (end.min(cell.end()), cell.kind.width());
            while at < stop {
                let (element, skip) = cell.element(at);
                let bytes = match cell.source {
                    Source::Data(first) => self.led_to(usize::from(first) + element).into(),
                    source => self.value(source, element),
                }
                .to_le_bytes();
                let take = usize::from(skip)..usize::from(width.min(skip + (stop - at)));
                for &byte in bytes.get(take).unwrap_or_default() {
                    put(byte);
                    at += 1;
                }
            }
        }
    }

    /// Returns the low bytes of an element of a cell that is not indirect data.
    fn value(&self, source: Source, element: usize) -> u32 {
        match source {
            Source::Params => self.settings().record.params.to_array().get(element).map_or(0, |&value| value as u32),
            Source::Addresses(first) => self.indirect(usize::from(first) + element).into(),
            source => self.register(source, element),
        }
    }

    fn indirect(&self, place: usize) -> u16 {
        self.settings().indirect.get(place).copied().unwrap_or(0)
    }

    /// Returns the byte that an indirect address leads to.
    fn led_to(&self, place: usize) -> u8 {
        let target = self.indirect(place);
        let Ok(cell) = Cell::at::<ROWS, COLUMNS>(target) else { return 0 };
        let (element, skip) = cell.element(target);
        let bytes = if target == 0 { [0; 4] } else { self.value(cell.source, element).to_le_bytes() };
        bytes.get(usize::from(skip)).copied().unwrap_or(0)
    }
}
