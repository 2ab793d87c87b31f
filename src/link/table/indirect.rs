//! Indirect registers: bytes of the table gathered where a driver wants them side by side.
//!
//! Each byte of `INDIRECT_DATA` is the byte at the address in the `INDIRECT_ADDRESS` of the same number. There are
//! two blocks of 28, at the addresses of the X-series servos' first one and at addresses of our own: one for what a
//! driver writes, and one for what it reads. They live in RAM, and none of them leads to another.

use crate::link::packet::StatusError;

use super::{Access, Cell, Kind, Register};

/// Number of bytes of a block.
pub const BLOCK: usize = 28;
/// Number of bytes of both blocks.
pub const COUNT: usize = 2 * BLOCK;
/// The least address that they lead to: what lies below is stored, and identifies the device.
const TARGET_MIN: u16 = 64;

/// Addresses of the blocks.
pub(super) mod address {
    /// Addresses of the first block.
    pub const INDIRECT_ADDRESS_1: u16 = 168;
    /// Bytes of the first block.
    pub const INDIRECT_DATA_1: u16 = 224;
    /// Addresses of the second block.
    pub const INDIRECT_ADDRESS_29: u16 = 400;
    /// Bytes of the second block.
    pub const INDIRECT_DATA_29: u16 = 456;
}

use address::{INDIRECT_ADDRESS_1, INDIRECT_ADDRESS_29, INDIRECT_DATA_1, INDIRECT_DATA_29};

const ADDRESS_DOC: &str = " Address of the byte of the same number in the indirect data: 64 or above, in any register \
    but the indirect ones, else a range error. 0 is none. Kept until a reset.";
const DATA_DOC: &str = " Bytes at the indirect addresses; 0 for an address of 0. A write follows the rules of \
    its registers and covers whole ones.";

/// Kind of an indirect cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The address in this place.
    Address(usize),
    /// The byte in this place.
    Data(usize),
}

/// Returns the kind of the block that begins here.
pub(super) const fn part(cell: u16) -> Option<Part> {
    match cell {
        INDIRECT_ADDRESS_1 => Some(Part::Address(0)),
        INDIRECT_ADDRESS_29 => Some(Part::Address(BLOCK)),
        INDIRECT_DATA_1 => Some(Part::Data(0)),
        INDIRECT_DATA_29 => Some(Part::Data(BLOCK)),
        _ => None,
    }
}

/// Returns true if a block begins here.
pub const fn begins(address: u16) -> bool {
    part(address).is_some()
}

const fn addresses(address: u16) -> Cell {
    Cell { address, of: address, count: BLOCK as u16, kind: Kind::U16, access: Access::ReadWrite }
}

const fn data(address: u16) -> Cell {
    Cell { address, of: address, count: BLOCK as u16, kind: Kind::U8, access: Access::ReadWrite }
}

pub(super) static CELLS: [Cell; 4] =
    [addresses(INDIRECT_ADDRESS_1), data(INDIRECT_DATA_1), addresses(INDIRECT_ADDRESS_29), data(INDIRECT_DATA_29)];

/// The indirect registers, as documented.
pub(super) const REGISTERS: [Register; 4] = [
    register("INDIRECT_ADDRESS_1", addresses(INDIRECT_ADDRESS_1), 0xFFFF, Some(0), ADDRESS_DOC),
    register("INDIRECT_DATA_1", data(INDIRECT_DATA_1), 0xFF, None, DATA_DOC),
    register("INDIRECT_ADDRESS_29", addresses(INDIRECT_ADDRESS_29), 0xFFFF, Some(0), ADDRESS_DOC),
    register("INDIRECT_DATA_29", data(INDIRECT_DATA_29), 0xFF, None, DATA_DOC),
];

const fn register(name: &'static str, cell: Cell, max: i64, default: Option<i64>, doc: &'static str) -> Register {
    let Cell { address, count, kind, access, .. } = cell;
    Register { name, address, kind, count, access, unit: "", scale: 1, min: 0, max, default, doc }
}

/// Refuses an address that they must not lead to.
pub(super) fn check<const ROWS: usize, const COLUMNS: usize>(target: u16) -> Result<(), StatusError> {
    if target == 0 {
        return Ok(());
    }
    let cell = Cell::at::<ROWS, COLUMNS>(target).filter(|cell| target >= TARGET_MIN && part(cell.of).is_none());
    if cell.is_some() { Ok(()) } else { Err(StatusError::Range) }
}
