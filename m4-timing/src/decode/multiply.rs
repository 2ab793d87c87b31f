//! Multiplications and divisions of 32 bits length.

use super::{field, register, wide::result};
use crate::instruction::{Instruction, Kind, bit};

/// Products of 32 bits.
pub(super) fn short(first: u32, second: u32) -> Option<Instruction> {
    if field(second, 6, 2) != 0 {
        return None;
    }
    let known = match (field(first, 4, 3), field(second, 4, 2)) {
        // MUL and MLA, MLS; halfwords; dual; word by halfword; dual with difference; most significant word, less it.
        (0, 0 | 1) | (1, _) | (2..=6, 0 | 1) | (7, 0) => true,
        _ => false,
    };
    if known { result(Kind::Multiply, register(second, 8)) } else { None }
}

/// Products of 64 bits, and divisions.
pub(super) fn long(first: u32, second: u32) -> Option<Instruction> {
    let (low, high) = (register(second, 12), register(second, 8));
    let divide = |signed| {
        let kind = Kind::Divide { signed, numerator: register(first, 0), denominator: register(second, 0) };
        if low == 15 { result(kind, high) } else { None }
    };
    match (field(first, 4, 3), field(second, 4, 4)) {
        (1, 15) => divide(true),
        (3, 15) => divide(false),
        (0 | 2, 0) | (4, 0 | 8..=13) | (5, 12 | 13) | (6, 0 | 6) => {
            Some(Instruction::new(Kind::Multiply, true).writing(bit(low) | bit(high)))
        }
        _ => None,
    }
}
