//! The single-precision FPU.

use super::{field, register};
use crate::instruction::{FPSCR, FloatSet, Instruction, Kind, PC, bit};

/// Words of the register file.
const WORDS: u32 = 32;

pub(super) fn decode(first: u32, second: u32) -> Option<Instruction> {
    let double = match field(second, 8, 4) {
        10 => false,
        11 => true,
        _ => return None,
    };
    match field(first, 8, 8) {
        0xec | 0xed if field(first, 5, 4) == 0b0010 => pair(first, second, double),
        0xec | 0xed => memory(first, second, double),
        0xee if field(second, 4, 1) != 0 => transfer(first, second, double),
        // Arithmetic in double precision is for another FPU.
        0xee if !double => arithmetic(first, second),
        _ => None,
    }
}

/// `count` registers from one on, within the register file.
fn registers(start: u32, count: u32) -> Option<FloatSet> {
    (start + count <= WORDS).then(|| ((1 << count) - 1) << start)
}

/// The number of a single: four bits, and the lowest apart.
fn single(word: u32, low: u32, extra: u32) -> u32 {
    field(word, low, 4) << 1 | extra
}

/// The first word of what the destination's field means.
fn destination(first: u32, second: u32, double: bool) -> u32 {
    if double { (field(first, 6, 1) << 4 | field(second, 12, 4)) << 1 } else { single(second, 12, field(first, 6, 1)) }
}

/// VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP.
fn memory(first: u32, second: u32, double: bool) -> Option<Instruction> {
    let (before, up, back, load) =
        (field(first, 8, 1), field(first, 7, 1), field(first, 5, 1), field(first, 4, 1) != 0);
    let base = register(first, 0);
    let start = destination(first, second, double);
    let words = field(second, 0, 8);
    let address = bit(base) & !bit(PC);
    if (before, back) == (1, 0) {
        let count = 1 + u32::from(double);
        let set = registers(start, count)?;
        let instruction = match (load, double) {
            (true, false) => Instruction::new(Kind::FloatLoad, true).float(0, set),
            (true, true) => Instruction::new(Kind::FloatLoadMany(2), true).float(0, set),
            (false, false) => Instruction::new(Kind::FloatStore, true).float(set, 0),
            (false, true) => Instruction::new(Kind::FloatStoreMany(2), true).float(set, 0),
        };
        return Some(instruction.at(address));
    }
    // Increment after, with or without write-back, or decrement before with it.
    if !matches!((before, up, back), (0, 1, _) | (1, 0, 1)) || words == 0 || words > WORDS {
        return None;
    }
    let set = registers(start, words)?;
    let instruction = if load {
        Instruction::new(Kind::FloatLoadMany(words as u8), true).float(0, set)
    } else {
        Instruction::new(Kind::FloatStoreMany(words as u8), true).float(set, 0)
    };
    Some(instruction.at(address).writing(if back != 0 { bit(base) } else { 0 }))
}

/// VMOV between two core registers and two singles or a double.
fn pair(first: u32, second: u32, double: bool) -> Option<Instruction> {
    if field(second, 6, 2) != 0 || field(second, 4, 1) == 0 || field(first, 8, 1) != 0 {
        return None;
    }
    let extra = field(second, 5, 1);
    let start = if double { (extra << 4 | field(second, 0, 4)) << 1 } else { single(second, 0, extra) };
    let set = registers(start, 2)?;
    let core = bit(register(second, 12)) | bit(register(first, 0));
    let new = Instruction::new(Kind::FloatMove(2), true);
    Some(if field(first, 4, 1) != 0 { new.float(set, 0).writing(core) } else { new.float(0, set) })
}

/// VMOV of one word, VMRS, VMSR.
fn transfer(first: u32, second: u32, double: bool) -> Option<Instruction> {
    let to_core = field(first, 4, 1) != 0;
    let core = register(second, 12);
    let set = match (double, field(first, 5, 3)) {
        (false, 0) => 1 << single(first, 0, field(second, 7, 1)),
        // Half of a double.
        (true, half @ (0 | 1)) if field(second, 5, 2) == 0 => {
            registers(((field(second, 7, 1) << 4 | field(first, 0, 4)) << 1) + half, 1)?
        }
        (false, 7) => {
            let new = Instruction::new(Kind::Float, true);
            let writes = if core == PC { 0 } else { bit(core) };
            return Some(if to_core { new.float(FPSCR, 0).writing(writes) } else { new.float(0, FPSCR) });
        }
        _ => return None,
    };
    let new = Instruction::new(Kind::FloatMove(1), true);
    Some(if to_core { new.float(set, 0).writing(bit(core)) } else { new.float(0, set) })
}

/// Data processing.
fn arithmetic(first: u32, second: u32) -> Option<Instruction> {
    let d = 1 << destination(first, second, false);
    let n = 1 << single(first, 0, field(second, 7, 1));
    let m = 1 << single(second, 0, field(second, 5, 1));
    let negative = field(second, 6, 1) != 0;
    let new = |kind, reads, writes| Some(Instruction::new(kind, true).float(reads, writes));
    match (field(first, 7, 1), field(first, 4, 2)) {
        (0, 0 | 1) | (1, 1 | 2) => new(Kind::FloatAccumulate, d | n | m, d),
        (0, _) => new(Kind::Float, n | m, d),
        (1, 0) if !negative => new(Kind::FloatDivide, n | m, d),
        (1, 3) if !negative => {
            // An immediate; the bits that otherwise name a register are zero.
            if field(second, 5, 3) == 0 { new(Kind::Float, 0, d) } else { None }
        }
        (1, 3) => match (field(first, 0, 4), field(second, 7, 1)) {
            // Move and absolute value, negation; square root.
            (0, _) | (1, 0) => new(Kind::Float, m, d),
            (1, 1) => new(Kind::FloatDivide, m, d),
            // Half precision, comparison with a register and with zero.
            (2 | 3, _) => new(Kind::Float, m | d, d),
            (4, _) => new(Kind::Float, d | m, FPSCR),
            (5, _) => new(Kind::Float, d, FPSCR),
            // Conversions from and to integers, and fixed point in place.
            (8 | 12 | 13, _) => new(Kind::Float, m, d),
            (10 | 11 | 14 | 15, _) => new(Kind::Float, d, d),
            _ => None,
        },
        _ => None,
    }
}
