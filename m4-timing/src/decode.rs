//! Machine code to instructions: Thumb-2 of ARMv7E-M with the single-precision FPU (VFPv4-SP).
//!
//! Only encodings that the architecture defines for this core are accepted; everything else is [`Unknown`].

mod float;
mod memory;
mod multiply;
mod narrow;
mod wide;

use crate::instruction::Instruction;
use std::fmt;

/// Machine code that this core does not have, or whose time is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// The first halfword.
    pub first: u16,
    /// The second, where there is one.
    pub second: Option<u16>,
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04x}", self.first)?;
        self.second.map_or(Ok(()), |second| write!(f, " {second:04x}"))
    }
}

/// Whether a first halfword begins an instruction of 32 bits.
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Decodes the bytes of one instruction, little-endian.
///
/// # Errors
/// It is no instruction of a Cortex-M4F.
pub fn decode(bytes: &[u8]) -> Result<Instruction, Unknown> {
    let halfword = |place: usize| Some(u16::from_le_bytes([*bytes.get(place)?, *bytes.get(place + 1)?]));
    let first = halfword(0).unwrap_or(0xffff);
    let second = halfword(2);
    let found = match second {
        Some(second) if is_wide(first) => wide::decode(first.into(), second.into()),
        None if !is_wide(first) => narrow::decode(first.into()),
        _ => None,
    };
    found.ok_or(Unknown { first, second })
}

/// `width` bits of a word from bit `low` on.
const fn field(word: u32, low: u32, width: u32) -> u32 {
    word >> low & ((1 << width) - 1)
}

/// A register's number in four bits from bit `low` on.
const fn register(word: u32, low: u32) -> u8 {
    field(word, low, 4) as u8
}
