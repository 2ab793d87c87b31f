//! Instructions of 16 bits.

use super::field;
use crate::instruction::{Instruction, Kind, LR, PC, SP, bit};

pub(super) fn decode(word: u32) -> Option<Instruction> {
    let new = |kind| Some(Instruction::new(kind, false));
    let alu = |register: u32| Some(Instruction::new(Kind::Alu, false).writing(bit(register as u8)));
    let low = field(word, 0, 3);
    let upper = field(word, 8, 3);
    match word >> 10 {
        // Shift, add, subtract, move; compare writes nothing.
        0b000000..=0b000111 => alu(low),
        0b001010 | 0b001011 => new(Kind::Alu),
        0b001000..=0b001111 => alu(upper),
        0b010000 => match field(word, 6, 4) {
            8 | 10 | 11 => new(Kind::Alu),
            13 => Some(Instruction::new(Kind::Multiply, false).writing(bit(low as u8))),
            _ => alu(low),
        },
        0b010001 => special(word),
        0b010010 | 0b010011 => Some(Instruction::new(Kind::Load, false).writing(bit(upper as u8))),
        0b010100..=0b010111 => {
            let load = field(word, 9, 3) >= 3;
            let address = bit(field(word, 3, 3) as u8) | bit(field(word, 6, 3) as u8);
            single(load, Kind::StoreIndexed, low, address)
        }
        0b011000..=0b100011 => single(field(word, 11, 1) != 0, Kind::Store, low, bit(field(word, 3, 3) as u8)),
        0b100100..=0b100111 => single(field(word, 11, 1) != 0, Kind::Store, upper, bit(SP)),
        // ADR, and SP plus a number.
        0b101000..=0b101011 => alu(upper),
        0b101100..=0b101111 => miscellaneous(word),
        0b110000..=0b110011 => many(word),
        0b110100..=0b110111 => match field(word, 8, 4) {
            14 | 15 => new(Kind::Untimed),
            _ => Some(Instruction::new(Kind::Branch { conditional: true }, false).writing(bit(PC))),
        },
        0b111000 | 0b111001 => Some(Instruction::new(Kind::Branch { conditional: false }, false).writing(bit(PC))),
        _ => None,
    }
}

fn single(load: bool, store: Kind, register: u32, address: u16) -> Option<Instruction> {
    let instruction = if load {
        Instruction::new(Kind::Load, false).writing(bit(register as u8))
    } else {
        Instruction::new(store, false)
    };
    Some(instruction.at(address))
}

/// Data processing with high registers, and branches to registers.
fn special(word: u32) -> Option<Instruction> {
    let destination = (field(word, 4, 4) & 8 | field(word, 0, 3)) as u8;
    match (field(word, 8, 2), destination) {
        (1, _) => Some(Instruction::new(Kind::Alu, false)),
        (0 | 2, PC) => Some(Instruction::new(Kind::Jump, false).writing(bit(PC))),
        (0 | 2, _) => Some(Instruction::new(Kind::Alu, false).writing(bit(destination))),
        _ if field(word, 0, 3) != 0 => None,
        _ => {
            let link = if field(word, 7, 1) != 0 { bit(LR) } else { 0 };
            Some(Instruction::new(Kind::Jump, false).writing(link | bit(PC)))
        }
    }
}

fn miscellaneous(word: u32) -> Option<Instruction> {
    let destination = bit(field(word, 0, 3) as u8);
    match field(word, 8, 4) {
        0b0000 => Some(Instruction::new(Kind::Alu, false).writing(bit(SP))),
        0b0001 | 0b0011 | 0b1001 | 0b1011 => {
            Some(Instruction::new(Kind::Branch { conditional: true }, false).writing(bit(PC)))
        }
        0b0010 => Some(Instruction::new(Kind::Alu, false).writing(destination)),
        0b0100 | 0b0101 => {
            let count = field(word, 0, 9).count_ones() as u8;
            (count > 0).then(|| Instruction::new(Kind::StoreMany(count), false).writing(bit(SP)).at(bit(SP)))
        }
        0b0110 => matches!(field(word, 5, 3), 3).then(|| Instruction::new(Kind::Special, false)),
        0b1010 => (field(word, 6, 2) != 2).then(|| Instruction::new(Kind::Alu, false).writing(destination)),
        0b1100 | 0b1101 => {
            let list = field(word, 0, 8) as u16 | if field(word, 8, 1) != 0 { bit(PC) } else { 0 };
            let kind = Kind::LoadMany(list.count_ones() as u8);
            (list != 0).then(|| Instruction::new(kind, false).writing(list | bit(SP)).at(bit(SP)))
        }
        0b1110 => Some(Instruction::new(Kind::Untimed, false)),
        0b1111 if field(word, 0, 4) != 0 => {
            Some(Instruction::new(Kind::IfThen { state: field(word, 0, 8) as u8 }, false))
        }
        0b1111 => hint(field(word, 4, 4), false),
        _ => None,
    }
}

/// NOP and YIELD do nothing on this core; WFE, WFI and SEV have no time of their own.
pub(super) fn hint(number: u32, wide: bool) -> Option<Instruction> {
    let kind = match number {
        0 | 1 => Kind::Alu,
        2..=4 => Kind::Untimed,
        _ => return None,
    };
    Some(Instruction::new(kind, wide))
}

/// LDM and STM.
fn many(word: u32) -> Option<Instruction> {
    let base = bit(field(word, 8, 3) as u8);
    let list = field(word, 0, 8) as u16;
    let count = list.count_ones() as u8;
    if count == 0 {
        return None;
    }
    let (kind, writes) = if field(word, 11, 1) != 0 {
        // The base is written back where it is not loaded; either way it is written.
        (Kind::LoadMany(count), list | base)
    } else {
        (Kind::StoreMany(count), base)
    };
    Some(Instruction::new(kind, false).writing(writes).at(base))
}
