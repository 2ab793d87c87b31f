//! Loads and stores of 32 bits length.

use super::{field, register};
use crate::instruction::{CoreSet, Instruction, Kind, PC, bit};

/// What a write-back adds to the registers written.
fn written_back(word: u32, base: CoreSet) -> CoreSet {
    if field(word, 5, 1) != 0 { base } else { 0 }
}

/// LDM and STM, PUSH and POP.
pub(super) fn many(first: u32, second: u32) -> Option<Instruction> {
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
pub(super) fn double(first: u32, second: u32) -> Option<Instruction> {
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
pub(super) fn single(first: u32, second: u32) -> Option<Instruction> {
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
