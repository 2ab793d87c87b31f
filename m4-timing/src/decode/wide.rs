//! Instructions of 32 bits: data processing, branches and system instructions.

use super::{field, float, memory, multiply, narrow, register};
use crate::instruction::{Instruction, Kind, LR, PC, bit};

pub(super) fn decode(first: u32, second: u32) -> Option<Instruction> {
    let major = field(first, 4, 7);
    match field(first, 11, 2) {
        0b01 => match major {
            _ if major & 0x64 == 0x00 => memory::many(first, second),
            _ if major & 0x64 == 0x04 => memory::double(first, second),
            _ if major & 0x60 == 0x20 => shifted(first, second),
            _ => float::decode(first, second),
        },
        0b10 if second >> 15 != 0 => control(first, second),
        0b10 if major & 0x20 == 0 => modified(first, second),
        0b10 => plain(first, second),
        0b11 => match major {
            _ if major & 0x60 == 0 => memory::single(first, second),
            _ if major & 0x70 == 0x20 => registers(first, second),
            _ if major & 0x78 == 0x30 => multiply::short(first, second),
            _ if major & 0x78 == 0x38 => multiply::long(first, second),
            _ => None,
        },
        _ => None,
    }
}

/// An instruction of 32 bits that writes one register, which is not the program counter.
pub(super) fn result(kind: Kind, destination: u8) -> Option<Instruction> {
    (destination != PC).then(|| Instruction::new(kind, true).writing(bit(destination)))
}

/// Data processing with a shifted register.
fn shifted(first: u32, second: u32) -> Option<Instruction> {
    if field(second, 15, 1) != 0 {
        return None;
    }
    operation(field(first, 5, 4), first, second, true)
}

/// Data processing with an immediate of eight bits, shifted or repeated.
fn modified(first: u32, second: u32) -> Option<Instruction> {
    operation(field(first, 5, 4), first, second, false)
}

fn operation(code: u32, first: u32, second: u32, packs: bool) -> Option<Instruction> {
    let pack = packs && code == 6 && field(first, 4, 1) == 0 && field(second, 4, 1) == 0;
    let known = matches!(code, 0..=4 | 8 | 10 | 11 | 13 | 14) || pack;
    let destination = register(second, 8);
    // AND, EOR, ADD and SUB without a destination are TST, TEQ, CMN and CMP, which always set flags.
    let compares = matches!(code, 0 | 4 | 8 | 13) && field(first, 4, 1) != 0;
    match destination {
        _ if !known => None,
        PC if compares => Some(Instruction::new(Kind::Alu, true)),
        _ => result(Kind::Alu, destination),
    }
}

/// Additions and moves of wide immediates, saturation, bit fields.
fn plain(first: u32, second: u32) -> Option<Instruction> {
    match field(first, 4, 5) {
        0 | 4 | 10 | 12 | 16 | 18 | 20 | 22 | 24 | 26 | 28 => result(Kind::Alu, register(second, 8)),
        _ => None,
    }
}

/// Data processing on registers: shifts, extensions, packed arithmetic, bit reversals.
fn registers(first: u32, second: u32) -> Option<Instruction> {
    if field(second, 12, 4) != 15 {
        return None;
    }
    let (major, minor) = (field(first, 4, 4), field(second, 4, 4));
    let known = match (major, minor) {
        (0..=7, 0) | (0..=5, 8..=11) => true,
        (8..=14, 0..=2 | 4..=6) => !matches!(major, 11),
        (8..=9, 8..=11) | (10 | 11, 8) => true,
        _ => false,
    };
    if known { result(Kind::Alu, register(second, 8)) } else { None }
}

/// Branches, special registers, hints and barriers.
fn control(first: u32, second: u32) -> Option<Instruction> {
    let branch = |conditional, link| {
        let writes = bit(PC) | if link { bit(LR) } else { 0 };
        Some(Instruction::new(Kind::Branch { conditional }, true).writing(writes))
    };
    match (field(second, 14, 1), field(second, 12, 1)) {
        (0, 1) => branch(false, false),
        (1, 1) => branch(false, true),
        // BLX to Arm code: this core has none. But UDF lies here, too.
        (1, 0) => {
            (field(first, 4, 7) == 0x7f && field(second, 12, 2) == 2).then(|| Instruction::new(Kind::Untimed, true))
        }
        _ if field(first, 7, 3) != 7 => branch(true, false),
        _ => system(first, second),
    }
}

fn system(first: u32, second: u32) -> Option<Instruction> {
    match field(first, 4, 7) {
        0x38 => Some(Instruction::new(Kind::Special, true)),
        0x3a if field(second, 8, 3) == 0 => match field(second, 0, 8) {
            0x40 => Some(Instruction::new(Kind::Begin, true)),
            0x41 => Some(Instruction::new(Kind::End, true)),
            number => narrow::hint(number, true),
        },
        0x3b => match field(second, 4, 4) {
            2 => Some(Instruction::new(Kind::Alu, true)),
            4..=6 => Some(Instruction::new(Kind::Barrier, true)),
            _ => None,
        },
        0x7f if field(second, 12, 3) == 2 => Some(Instruction::new(Kind::Untimed, true)),
        0x3e => result(Kind::Special, register(second, 8)),
        _ => None,
    }
}
