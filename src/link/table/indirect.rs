//! Indirect registers: bytes of the table gathered where a driver wants them side by side.
//!
//! Each byte of `INDIRECT_DATA` is the byte at the address in the `INDIRECT_ADDRESS` of the same number. There are
//! two blocks of 28, at the addresses of the X-series servos' first one and at addresses of our own: one for what a
//! driver writes, and one for what it reads. They live in RAM, and none of them leads to another.

use super::registers::Source;
use super::{Access, Kind, Register};

/// Number of bytes of a block.
pub const BLOCK: usize = 28;
/// Number of bytes of both blocks.
pub const COUNT: usize = 2 * BLOCK;
/// Lowest address that they may lead to: the registers below are stored, or identify the device.
pub(super) const TARGET_MIN: u16 = 64;

/// Addresses of the blocks.
pub(super) mod address {
    /// Indirect addresses of the first block.
    pub const INDIRECT_ADDRESS_1: u16 = 168;
    /// Data that the addresses of the first block lead to.
    pub const INDIRECT_DATA_1: u16 = 224;
    /// Indirect addresses of the second block.
    pub const INDIRECT_ADDRESS_29: u16 = 400;
    /// Data that the addresses of the second block lead to.
    pub const INDIRECT_DATA_29: u16 = 456;
}

use address::{INDIRECT_ADDRESS_1, INDIRECT_ADDRESS_29, INDIRECT_DATA_1, INDIRECT_DATA_29};

const ADDRESS_DOC: &str = " Address of the byte of the same number in the indirect data: 64 or above, in any register \
    but the indirect ones, else a range error. 0 is none. Kept until a reset.";
const DATA_DOC: &str = " Bytes at the indirect addresses; 0 for an address of 0. A write follows the rules of \
    its registers and covers whole ones.";

/// Returns true if a block begins here.
pub const fn begins(address: u16) -> bool {
    matches!(address, INDIRECT_ADDRESS_1 | INDIRECT_DATA_1 | INDIRECT_ADDRESS_29 | INDIRECT_DATA_29)
}

/// The indirect registers, as documented.
pub(super) const REGISTERS: [Register; 4] = [
    addresses("INDIRECT_ADDRESS_1", INDIRECT_ADDRESS_1, 0),
    data("INDIRECT_DATA_1", INDIRECT_DATA_1, 0),
    addresses("INDIRECT_ADDRESS_29", INDIRECT_ADDRESS_29, BLOCK),
    data("INDIRECT_DATA_29", INDIRECT_DATA_29, BLOCK),
];

const fn addresses(name: &'static str, address: u16, first: usize) -> Register {
    let source = Source::Addresses(first as u8);
    Register::new((name, source), address, Kind::U16, Access::ReadWrite, ADDRESS_DOC).count(BLOCK).default(0)
}

const fn data(name: &'static str, address: u16, first: usize) -> Register {
    let source = Source::Data(first as u8);
    Register::new((name, source), address, Kind::U8, Access::ReadWrite, DATA_DOC).count(BLOCK)
}
