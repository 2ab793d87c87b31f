//! Machine code to instructions: Thumb-2 of ARMv7E-M with the single-precision FPU (VFPv4-SP).
//!
//! Only encodings that the architecture defines for this core are accepted; everything else is [`Unknown`].

use crate::instruction::{CoreSet, FPSCR, FloatSet, Instruction, Kind, LR, PC, SP, bit};
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

/// True if a first halfword begins an instruction of 32 bits.
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Decodes the bytes of one instruction, little-endian.
///
/// # Errors
/// The bytes are no instruction of a Cortex-M4F.
pub fn decode(bytes: &[u8]) -> Result<Instruction, Unknown> {
    let halfword = |place: usize| Some(u16::from_le_bytes([*bytes.get(place)?, *bytes.get(place + 1)?]));
    let first = halfword(0).unwrap_or(0xffff);
    let second = halfword(2);
    let found = match second {
        Some(second) if is_wide(first) => wide(first.into(), second.into()),
        None if !is_wide(first) => narrow(first.into()),
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

// Instructions of 16 bits.

fn narrow(word: u32) -> Option<Instruction> {
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
            narrow_single(load, Kind::StoreIndexed, low, address)
        }
        0b011000..=0b100011 => narrow_single(field(word, 11, 1) != 0, Kind::Store, low, bit(field(word, 3, 3) as u8)),
        0b100100..=0b100111 => narrow_single(field(word, 11, 1) != 0, Kind::Store, upper, bit(SP)),
        // ADR, and SP plus a number.
        0b101000..=0b101011 => alu(upper),
        0b101100..=0b101111 => miscellaneous(word),
        0b110000..=0b110011 => narrow_many(word),
        0b110100..=0b110111 => match field(word, 8, 4) {
            14 | 15 => new(Kind::Untimed),
            _ => Some(Instruction::new(Kind::Branch { conditional: true }, false).writing(bit(PC))),
        },
        0b111000 | 0b111001 => Some(Instruction::new(Kind::Branch { conditional: false }, false).writing(bit(PC))),
        _ => None,
    }
}

fn narrow_single(load: bool, store: Kind, register: u32, address: u16) -> Option<Instruction> {
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
fn hint(number: u32, wide: bool) -> Option<Instruction> {
    let kind = match number {
        0 | 1 => Kind::Alu,
        2..=4 => Kind::Untimed,
        _ => return None,
    };
    Some(Instruction::new(kind, wide))
}

/// LDM and STM.
fn narrow_many(word: u32) -> Option<Instruction> {
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

// Instructions of 32 bits: data processing, branches and system instructions.

fn wide(first: u32, second: u32) -> Option<Instruction> {
    let major = field(first, 4, 7);
    match field(first, 11, 2) {
        0b01 => match major {
            _ if major & 0x64 == 0x00 => many(first, second),
            _ if major & 0x64 == 0x04 => double(first, second),
            _ if major & 0x60 == 0x20 => shifted(first, second),
            _ => float(first, second),
        },
        0b10 if second >> 15 != 0 => control(first, second),
        0b10 if major & 0x20 == 0 => modified(first, second),
        0b10 => plain(first, second),
        0b11 => match major {
            _ if major & 0x60 == 0 => single(first, second),
            _ if major & 0x70 == 0x20 => registers(first, second),
            _ if major & 0x78 == 0x30 => short(first, second),
            _ if major & 0x78 == 0x38 => long(first, second),
            _ => None,
        },
        _ => None,
    }
}

/// An instruction of 32 bits that writes one register, which is not the program counter.
fn result(kind: Kind, destination: u8) -> Option<Instruction> {
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
            number => hint(number, true),
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

// Loads and stores of 32 bits length.

/// Register that a write-back adds to the written ones.
fn written_back(word: u32, base: CoreSet) -> CoreSet {
    if field(word, 5, 1) != 0 { base } else { 0 }
}

/// LDM and STM, PUSH and POP.
fn many(first: u32, second: u32) -> Option<Instruction> {
    let list = second as CoreSet;
    let count = list.count_ones() as u8;
    // Increment after or decrement before; the others are for other profiles.
    if !matches!(field(first, 7, 2), 1 | 2) || count == 0 {
        return None;
    }
    let base = bit(register(first, 0));
    let back = written_back(first, base);
    let (kind, writes) =
        if field(first, 4, 1) != 0 { (Kind::LoadMany(count), list | back) } else { (Kind::StoreMany(count), back) };
    Some(Instruction::new(kind, true).writing(writes).at(base))
}

/// Two words, exclusives, and branches by a table.
fn double(first: u32, second: u32) -> Option<Instruction> {
    let base = bit(register(first, 0)) & !bit(PC);
    let (target, other) = (bit(register(second, 12)), bit(register(second, 8)));
    let load = field(first, 4, 1) != 0;
    let new = |kind| Instruction::new(kind, true).at(base);
    if field(first, 8, 1) != 0 || field(first, 5, 1) != 0 {
        let back = written_back(first, base);
        return Some(if load {
            new(Kind::LoadMany(2)).writing(target | other | back)
        } else {
            new(Kind::StoreMany(2)).writing(back)
        });
    }
    match (field(first, 7, 1), load, field(second, 4, 4)) {
        (0, false, _) => Some(new(Kind::StoreIndexed).writing(other)),
        (1, false, 4 | 5) => Some(new(Kind::StoreIndexed).writing(bit(register(second, 0)))),
        (0, true, _) | (1, true, 4 | 5) => Some(new(Kind::Load).writing(target)),
        (1, true, 0 | 1) => Some(new(Kind::Table).writing(bit(PC)).at(base | bit(register(second, 0)))),
        _ => None,
    }
}

/// Bytes, halfwords and words.
fn single(first: u32, second: u32) -> Option<Instruction> {
    let (signed, load, size) = (field(first, 8, 1) != 0, field(first, 4, 1) != 0, field(first, 5, 2));
    // There is no fourth size, no signed word and no signed store.
    if size == 3 || signed && (size == 2 || !load) {
        return None;
    }
    let base = register(first, 0);
    let target = register(second, 12);
    let literal = base == PC;
    if literal && !load {
        return None;
    }
    let (address, back, indexed) = if literal || field(first, 7, 1) != 0 {
        (bit(base) & !bit(PC), 0, false)
    } else if field(second, 11, 1) != 0 {
        let (before, back) = (field(second, 10, 1), field(second, 8, 1));
        if before == 0 && back == 0 {
            return None;
        }
        (bit(base), if back != 0 { bit(base) } else { 0 }, false)
    } else if field(second, 6, 6) == 0 {
        (bit(base) | bit(register(second, 0)), 0, true)
    } else {
        return None;
    };
    let kind = match (load, target) {
        // Loads of less than a word into the program counter are hints to fetch ahead, which do nothing here.
        (true, PC) if size < 2 => return Some(Instruction::new(Kind::Alu, true)),
        (true, PC) => Kind::LoadPc,
        (true, _) => Kind::Load,
        (false, PC) => return None,
        (false, _) if indexed => Kind::StoreIndexed,
        (false, _) => Kind::Store,
    };
    let writes = back | if load { bit(target) } else { 0 };
    Some(Instruction::new(kind, true).writing(writes).at(address))
}

// Multiplications and divisions of 32 bits length.

/// Products of 32 bits.
fn short(first: u32, second: u32) -> Option<Instruction> {
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
fn long(first: u32, second: u32) -> Option<Instruction> {
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

// The single-precision FPU.

/// Words of the register file.
const WORDS: u32 = 32;

fn float(first: u32, second: u32) -> Option<Instruction> {
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
fn float_registers(start: u32, count: u32) -> Option<FloatSet> {
    (start + count <= WORDS).then(|| ((1 << count) - 1) << start)
}

/// The number of a single: four bits, and the lowest apart.
fn float_single(word: u32, low: u32, extra: u32) -> u32 {
    field(word, low, 4) << 1 | extra
}

/// The first word of what the destination's field means.
fn destination(first: u32, second: u32, double: bool) -> u32 {
    if double {
        (field(first, 6, 1) << 4 | field(second, 12, 4)) << 1
    } else {
        float_single(second, 12, field(first, 6, 1))
    }
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
        let set = float_registers(start, count)?;
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
    let set = float_registers(start, words)?;
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
    let start = if double { (extra << 4 | field(second, 0, 4)) << 1 } else { float_single(second, 0, extra) };
    let set = float_registers(start, 2)?;
    let core = bit(register(second, 12)) | bit(register(first, 0));
    let new = Instruction::new(Kind::FloatMove(2), true);
    Some(if field(first, 4, 1) != 0 { new.float(set, 0).writing(core) } else { new.float(0, set) })
}

/// VMOV of one word, VMRS, VMSR.
fn transfer(first: u32, second: u32, double: bool) -> Option<Instruction> {
    let to_core = field(first, 4, 1) != 0;
    let core = register(second, 12);
    let set = match (double, field(first, 5, 3)) {
        (false, 0) => 1 << float_single(first, 0, field(second, 7, 1)),
        // Half of a double.
        (true, half @ (0 | 1)) if field(second, 5, 2) == 0 => {
            float_registers(((field(second, 7, 1) << 4 | field(first, 0, 4)) << 1) + half, 1)?
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
    let n = 1 << float_single(first, 0, field(second, 7, 1));
    let m = 1 << float_single(second, 0, field(second, 5, 1));
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
