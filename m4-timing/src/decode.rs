//! Machine code to instructions: Thumb-2 of ARMv7E-M with the single-precision FPU (VFPv4-SP).
//!
//! Only encodings that the architecture defines for this core are accepted; everything else is [`Unknown`].

use crate::instruction::{CoreSet, FPSCR, FloatSet, Instruction, Kind, LR, PC, SP, bit};
use std::fmt;

/// Machine code that this core does not have, or whose time is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unknown {
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
pub fn decode(bytes: &[u8]) -> Result<Instruction, Unknown> {
    let halfword = |place: usize| Some(u16::from_le_bytes([*bytes.get(place)?, *bytes.get(place + 1)?]));
    let first = halfword(0).unwrap_or(0xffff);
    let second = halfword(2);
    let find = |rows: &[Row], word: u32| rows.iter().find_map(|row| filled(row, word));
    let found = match second {
        Some(second) if is_wide(first) => find(WIDE, u32::from(first) << 16 | u32::from(second)),
        None if !is_wide(first) => find(NARROW, first.into()),
        _ => None,
    };
    found.ok_or(Unknown { first, second })
}

/// A pattern of bits, and the instruction but for what its letters stand for. The first row that fits counts.
///
/// `0` and `1` are themselves and `x` is any bit. Core registers: `d` is written and not the program counter, `e` and `g`
/// are written, `r` is not the program counter; `a` is the base of an address (the program counter makes none), written
/// back if `w` is set, `A` one that is always written back, `B` and `C` are the same but not the program counter, `b` is an
/// index; `l` is a list, `L` one that is written; `n` over `m` is a division. FPU registers, four bits and a bit in small
/// letters: `S` is written, `T` and `U` are read, `V` is both, of singles; `P` is written and `Q` is read, of doubles, or
/// their half `h`; `c` is a number of words. [`fits`] has the letters that stand for some values only.
type Row = (&'static str, Instruction);

/// An instruction that touches no register.
const fn of(kind: Kind) -> Instruction {
    Instruction { kind, wide: false, writes: 0, address: 0, float_reads: 0, float_writes: 0 }
}

const ALU: Instruction = of(Kind::Alu);
const LOAD: Instruction = of(Kind::Load);
const LOAD_PC: Instruction = of(Kind::LoadPc).writing(bit(PC));
const BRANCH: Instruction = of(Kind::Branch { conditional: false }).writing(bit(PC));
const BRANCH_IF: Instruction = of(Kind::Branch { conditional: true }).writing(bit(PC));
const JUMP: Instruction = of(Kind::Jump).writing(bit(PC));
const UNTIMED: Instruction = of(Kind::Untimed);

const NARROW: &[Row] = &[
    // Shift, add, subtract, move; compare writes nothing.
    ("000x xxxx xxxx xddd", ALU),
    ("0010 1xxx xxxx xxxx", ALU),
    ("001x xddd xxxx xxxx", ALU),
    ("0100 0010 00xx xxxx", ALU),
    ("0100 0010 1xxx xxxx", ALU),
    ("0100 00xx xxxx xddd", ALU),
    // High registers, and branches to registers.
    ("0100 0101 xxxx xxxx", ALU),
    ("0100 01x0 1xxx x111", JUMP),
    ("0100 01x0 exxx xeee", ALU),
    ("0100 0111 0xxx x000", JUMP),
    ("0100 0111 1xxx x000", JUMP.writing(bit(PC) | bit(LR))),
    ("0100 1ddd xxxx xxxx", LOAD),
    ("0101 yyyb bbaa axxx", of(Kind::StoreIndexed)),
    ("0101 xxxb bbaa addd", LOAD),
    ("011x 0xxx xxaa axxx", of(Kind::Store)),
    ("011x 1xxx xxaa addd", LOAD),
    ("1000 0xxx xxaa axxx", of(Kind::Store)),
    ("1000 1xxx xxaa addd", LOAD),
    ("1001 0xxx xxxx xxxx", of(Kind::Store).at(bit(SP))),
    ("1001 1ddd xxxx xxxx", LOAD.at(bit(SP))),
    // ADR, and SP plus a number.
    ("1010 xddd xxxx xxxx", ALU),
    ("1011 0000 xxxx xxxx", ALU.writing(bit(SP))),
    ("1011 x0x1 xxxx xxxx", BRANCH_IF),
    ("1011 0010 xxxx xddd", ALU),
    ("1011 010l llll llll", of(Kind::Many(0)).writing(bit(SP)).at(bit(SP))),
    ("1011 0110 011x xxxx", of(Kind::Move(1))),
    ("1011 1010 0xxx xddd", ALU),
    ("1011 1010 11xx xddd", ALU),
    ("1011 1100 LLLL LLLL", of(Kind::Many(0)).writing(bit(SP)).at(bit(SP))),
    ("1011 1101 LLLL LLLL", of(Kind::Many(0)).writing(bit(SP) | bit(PC)).at(bit(SP))),
    ("1011 1110 xxxx xxxx", UNTIMED),
    // If-then, and hints: NOP and YIELD do nothing on this core; WFE, WFI and SEV have no time of their own.
    ("1011 1111 xxxx MMMM", of(Kind::IfThen { state: 0 })),
    ("1011 1111 000x 0000", ALU),
    ("1011 1111 001x 0000", UNTIMED),
    ("1011 1111 0100 0000", UNTIMED),
    ("1100 0AAA llll llll", of(Kind::Many(0))),
    ("1100 1AAA LLLL LLLL", of(Kind::Many(0))),
    ("1101 111x xxxx xxxx", UNTIMED),
    ("1101 xxxx xxxx xxxx", BRANCH_IF),
    ("1110 0xxx xxxx xxxx", BRANCH),
];

const WIDE: &[Row] = &[
    // LDM and STM: increment after or decrement before; the others are for other profiles.
    ("1110 100j j0w0 aaaa llll llll llll llll", of(Kind::Many(0))),
    ("1110 100j j0w1 aaaa LLLL LLLL LLLL LLLL", of(Kind::Many(0))),
    // Two words, exclusives, and branches by a table.
    ("1110 1001 x1w1 aaaa eeee gggg xxxx xxxx", of(Kind::Many(2))),
    ("1110 1001 x1w0 aaaa xxxx xxxx xxxx xxxx", of(Kind::Many(2))),
    ("1110 1000 x111 AAAA eeee gggg xxxx xxxx", of(Kind::Many(2))),
    ("1110 1000 x110 AAAA xxxx xxxx xxxx xxxx", of(Kind::Many(2))),
    ("1110 1000 0100 aaaa xxxx eeee xxxx xxxx", of(Kind::StoreIndexed)),
    ("1110 1000 1100 aaaa xxxx xxxx 010x eeee", of(Kind::StoreIndexed)),
    ("1110 1000 0101 aaaa eeee xxxx xxxx xxxx", LOAD),
    ("1110 1000 1101 aaaa eeee xxxx 010x xxxx", LOAD),
    ("1110 1000 1101 aaaa xxxx xxxx 000x bbbb", of(Kind::Table).writing(bit(PC))),
    // Data processing with a shifted register. AND, EOR, ADD and SUB without a destination are TST, TEQ, CMN and CMP.
    ("1110 101k kkk1 xxxx 0xxx 1111 xxxx xxxx", ALU),
    ("1110 101o ooox xxxx 0xxx dddd xxxx xxxx", ALU),
    ("1110 1010 1100 xxxx 0xxx dddd xxx0 xxxx", ALU),
    // The same with an immediate of eight bits, shifted or repeated.
    ("1111 0x0k kkk1 xxxx 0xxx 1111 xxxx xxxx", ALU),
    ("1111 0x0o ooox xxxx 0xxx dddd xxxx xxxx", ALU),
    // Additions and moves of wide immediates, saturation, bit fields.
    ("1111 0x1i iiii xxxx 0xxx dddd xxxx xxxx", ALU),
    // Branches, special registers, hints and barriers; the others between them are not for this core.
    ("1111 0xxx xxxx xxxx 10x1 xxxx xxxx xxxx", BRANCH),
    ("1111 0xxx xxxx xxxx 11x1 xxxx xxxx xxxx", BRANCH.writing(bit(PC) | bit(LR))),
    ("1111 0xff ffxx xxxx 10x0 xxxx xxxx xxxx", BRANCH_IF),
    ("1111 0111 1111 xxxx 1x10 xxxx xxxx xxxx", UNTIMED),
    ("1111 0011 1000 xxxx 10x0 xxxx xxxx xxxx", of(Kind::Move(1))),
    ("1111 0011 1110 xxxx 10x0 dddd xxxx xxxx", of(Kind::Move(1))),
    ("1111 0011 1010 xxxx 10x0 x000 0100 0000", of(Kind::Begin)),
    ("1111 0011 1010 xxxx 10x0 x000 0100 0001", of(Kind::End)),
    ("1111 0011 1010 xxxx 10x0 x000 0000 000x", ALU),
    ("1111 0011 1010 xxxx 10x0 x000 0000 001x", UNTIMED),
    ("1111 0011 1010 xxxx 10x0 x000 0000 0100", UNTIMED),
    ("1111 0011 1011 xxxx 10x0 xxxx 0010 xxxx", ALU),
    ("1111 0011 1011 xxxx 10x0 xxxx 010x xxxx", of(Kind::Barrier)),
    ("1111 0011 1011 xxxx 10x0 xxxx 0110 xxxx", of(Kind::Barrier)),
    // Loads of less than a word into the program counter are hints to fetch ahead, which do nothing here.
    ("1111 100x x0x1 1111 1111 xxxx xxxx xxxx", ALU),
    ("1111 100x 10x1 xxxx 1111 xxxx xxxx xxxx", ALU),
    ("1111 100x 00x1 xxxx 1111 11xx xxxx xxxx", ALU),
    ("1111 100x 00x1 xxxx 1111 10x1 xxxx xxxx", ALU),
    ("1111 100x 00x1 xxxx 1111 0000 00xx xxxx", ALU),
    ("1111 1000 x101 1111 1111 xxxx xxxx xxxx", LOAD_PC),
    ("1111 1000 1101 aaaa 1111 xxxx xxxx xxxx", LOAD_PC),
    ("1111 1000 0101 aaaa 1111 11xw xxxx xxxx", LOAD_PC),
    ("1111 1000 0101 AAAA 1111 10x1 xxxx xxxx", LOAD_PC),
    ("1111 1000 0101 aaaa 1111 0000 00xx bbbb", LOAD_PC),
    // Bytes, halfwords and words, signed bytes and halfwords.
    ("1111 100z xzz1 1111 dddd xxxx xxxx xxxx", LOAD),
    ("1111 100z 1zz1 aaaa dddd xxxx xxxx xxxx", LOAD),
    ("1111 100z 0zz1 aaaa dddd 11xw xxxx xxxx", LOAD),
    ("1111 100z 0zz1 AAAA dddd 10x1 xxxx xxxx", LOAD),
    ("1111 100z 0zz1 aaaa dddd 0000 00xx bbbb", LOAD),
    ("1111 1000 1zz0 BBBB rrrr xxxx xxxx xxxx", of(Kind::Store)),
    ("1111 1000 0zz0 BBBB rrrr 11xw xxxx xxxx", of(Kind::Store)),
    ("1111 1000 0zz0 CCCC rrrr 10x1 xxxx xxxx", of(Kind::Store)),
    ("1111 1000 0zz0 BBBB rrrr 0000 00xx bbbb", of(Kind::StoreIndexed)),
    // Shifts, extensions, packed arithmetic, bit reversals.
    ("1111 1010 0xxx xxxx 1111 dddd 0000 xxxx", ALU),
    ("1111 1010 00xx xxxx 1111 dddd 10xx xxxx", ALU),
    ("1111 1010 010x xxxx 1111 dddd 10xx xxxx", ALU),
    ("1111 1010 1xyy xxxx 1111 dddd 0xzz xxxx", ALU),
    ("1111 1010 100x xxxx 1111 dddd 10xx xxxx", ALU),
    ("1111 1010 101x xxxx 1111 dddd 1000 xxxx", ALU),
    // Products of 32 bits, of 64 bits, and divisions.
    ("1111 1011 0001 xxxx xxxx dddd 00xx xxxx", ALU),
    ("1111 1011 00xx xxxx xxxx dddd 000x xxxx", ALU),
    ("1111 1011 010x xxxx xxxx dddd 000x xxxx", ALU),
    ("1111 1011 0110 xxxx xxxx dddd 000x xxxx", ALU),
    ("1111 1011 0111 xxxx xxxx dddd 0000 xxxx", ALU),
    ("1111 1011 1001 nnnn 1111 dddd 1111 mmmm", of(Kind::Divide { signed: true, numerator: 0, denominator: 0 })),
    ("1111 1011 1011 nnnn 1111 dddd 1111 mmmm", of(Kind::Divide { signed: false, numerator: 0, denominator: 0 })),
    ("1111 1011 1xx0 xxxx eeee gggg 0000 xxxx", ALU),
    ("1111 1011 1100 xxxx eeee gggg 10xx xxxx", ALU),
    ("1111 1011 110x xxxx eeee gggg 110x xxxx", ALU),
    ("1111 1011 1110 xxxx eeee gggg 0110 xxxx", ALU),
    // The FPU: VMOV between two core registers and two singles or a double.
    ("1110 1100 0101 eeee gggg 1010 00t1 TTTT", of(Kind::Move(2))),
    ("1110 1100 0100 xxxx xxxx 1010 00s1 SSSS", of(Kind::Move(2))),
    ("1110 1100 0101 eeee gggg 1011 00q1 QQQQ", of(Kind::Move(2))),
    ("1110 1100 0100 xxxx xxxx 1011 00p1 PPPP", of(Kind::Move(2))),
    // VLDR and VSTR first; the other words of this form are VLDM, VSTM, VPUSH and VPOP.
    ("1110 1101 xs01 aaaa SSSS 1010 xxxx xxxx", of(Kind::FloatWord)),
    ("1110 1101 xp01 aaaa PPPP 1011 xxxx xxxx", of(Kind::Many(2))),
    ("1110 1101 xt00 aaaa TTTT 1010 xxxx xxxx", of(Kind::FloatWord)),
    ("1110 1101 xq00 aaaa QQQQ 1011 xxxx xxxx", of(Kind::Many(2))),
    ("1110 110j jsw1 aaaa SSSS 1010 cccc cccc", of(Kind::Many(0))),
    ("1110 110j jpw1 aaaa PPPP 1011 cccc cccc", of(Kind::Many(0))),
    ("1110 110j jtw0 aaaa TTTT 1010 cccc cccc", of(Kind::Many(0))),
    ("1110 110j jqw0 aaaa QQQQ 1011 cccc cccc", of(Kind::Many(0))),
    // VMOV of one word, VMRS, VMSR.
    ("1110 1110 0001 TTTT eeee 1010 txx1 xxxx", of(Kind::Move(1))),
    ("1110 1110 0000 SSSS xxxx 1010 sxx1 xxxx", of(Kind::Move(1))),
    ("1110 1110 00h1 QQQQ eeee 1011 q001 xxxx", of(Kind::Move(1))),
    ("1110 1110 00h0 PPPP xxxx 1011 p001 xxxx", of(Kind::Move(1))),
    ("1110 1110 1111 xxxx dddd 1010 xxx1 xxxx", ALU.float(FPSCR, 0)),
    ("1110 1110 1111 xxxx 1111 1010 xxx1 xxxx", ALU.float(FPSCR, 0)),
    ("1110 1110 1110 xxxx xxxx 1010 xxx1 xxxx", ALU.float(0, FPSCR)),
    // Data processing. With an accumulator, without one, division.
    ("1110 1110 0v0x TTTT VVVV 1010 txu0 UUUU", of(Kind::FloatAccumulate)),
    ("1110 1110 1v01 TTTT VVVV 1010 txu0 UUUU", of(Kind::FloatAccumulate)),
    ("1110 1110 1v10 TTTT VVVV 1010 txu0 UUUU", of(Kind::FloatAccumulate)),
    ("1110 1110 0s1x TTTT SSSS 1010 txu0 UUUU", ALU),
    ("1110 1110 1s00 TTTT SSSS 1010 t0u0 UUUU", of(Kind::FloatDivide)),
    // An immediate; move, absolute value and conversion from an integer; negation; square root; half precision.
    ("1110 1110 1s11 xxxx SSSS 1010 0000 xxxx", ALU),
    ("1110 1110 1s11 x000 SSSS 1010 x1u0 UUUU", ALU),
    ("1110 1110 1s11 0001 SSSS 1010 01u0 UUUU", ALU),
    ("1110 1110 1s11 0001 SSSS 1010 11u0 UUUU", of(Kind::FloatDivide)),
    ("1110 1110 1v11 001x VVVV 1010 x1u0 UUUU", ALU),
    // Comparison with a register and with zero; conversions to integers, and fixed point in place.
    ("1110 1110 1t11 0100 TTTT 1010 x1u0 UUUU", ALU.float(0, FPSCR)),
    ("1110 1110 1t11 0101 TTTT 1010 x1x0 xxxx", ALU.float(0, FPSCR)),
    ("1110 1110 1s11 110x SSSS 1010 x1u0 UUUU", ALU),
    ("1110 1110 1v11 1x1x VVVV 1010 x1x0 xxxx", ALU),
];

/// True if a letter can have a value.
fn fits(letter: u8, value: u32) -> bool {
    match letter {
        b'd' | b'r' | b'B' | b'C' => value != u32::from(PC),
        // A condition, and the mask of the instructions that it is for.
        b'f' => value < 14,
        b'M' => value != 0,
        // A list is stored or loaded upwards, or downwards: the others are for other profiles.
        b'j' => value == 1 || value == 2,
        // Operations: all, those with a form that only compares, those with a wide immediate.
        b'o' => [0, 1, 2, 3, 4, 8, 10, 11, 13, 14].contains(&value),
        b'k' => [0, 4, 8, 13].contains(&value),
        b'i' => [0, 4, 10, 12, 16, 18, 20, 22, 24, 26, 28].contains(&value),
        // A size, with a sign before it where there is one.
        b'z' => [0, 1, 2, 4, 5].contains(&value),
        b'y' => value < 3,
        _ => true,
    }
}

/// The instruction of a row with the letters' values; `None` if the word does not fit.
fn filled((pattern, row): &Row, word: u32) -> Option<Instruction> {
    let width = pattern.bytes().filter(|letter| *letter != b' ').count();
    let bits = || pattern.bytes().filter(|letter| *letter != b' ').zip((0..width).rev().map(|place| word >> place & 1));
    if bits().any(|(letter, bit)| letter == b'0' && bit == 1 || letter == b'1' && bit == 0) {
        return None;
    }
    let value = |letter: u8| {
        let found = bits().filter(|(other, _)| *other == letter);
        found.fold(None, |value: Option<u32>, (_, bit)| Some(value.unwrap_or(0) << 1 | bit))
    };
    let core = |letter| value(letter).map_or(0, |register| bit(register as u8));
    if !bits().all(|(letter, _)| value(letter).is_none_or(|value| fits(letter, value))) {
        return None;
    }
    let base = (core(b'a') | core(b'A') | core(b'B') | core(b'C')) & !bit(PC);
    let back = if value(b'A').or(value(b'C')).is_some() || value(b'w') == Some(1) { base } else { 0 };
    let loaded = value(b'L').unwrap_or(0);
    let listed = (value(b'l').unwrap_or(0) | loaded).count_ones() + u32::from(row.writes & bit(PC) != 0);
    let kind = match row.kind {
        Kind::Many(0) => Kind::Many(value(b'c').or(Some(listed)).filter(|words| (1..=32).contains(words))? as u8),
        Kind::IfThen { .. } => Kind::IfThen { state: word as u8 },
        Kind::Divide { signed, .. } => {
            let register = |letter| value(letter).unwrap_or(0) as u8;
            Kind::Divide { signed, numerator: register(b'n'), denominator: register(b'm') }
        }
        kind => kind,
    };
    let words = match kind {
        Kind::Many(words) | Kind::Move(words) => words.into(),
        _ => 1,
    };
    // The registers of the file from one on; `None` beyond its end.
    let from = |start: u32| (start + words <= 32).then(|| ((1_u64 << words) - 1) << start);
    let singles = |letter: u8| match (value(letter), value(letter.to_ascii_lowercase())) {
        (Some(four), Some(lowest)) => from(four << 1 | lowest),
        _ => Some(0),
    };
    let doubles = |letter: u8| match (value(letter), value(letter.to_ascii_lowercase())) {
        (Some(four), Some(highest)) => from((highest << 4 | four) << 1 | value(b'h').unwrap_or(0)),
        _ => Some(0),
    };
    let both: FloatSet = singles(b'V')?;
    Some(Instruction {
        kind,
        wide: width == 32,
        writes: row.writes | core(b'd') | core(b'e') | core(b'g') | loaded as CoreSet | back,
        address: row.address | base | core(b'b'),
        float_reads: row.float_reads | singles(b'T')? | singles(b'U')? | doubles(b'Q')? | both,
        float_writes: row.float_writes | singles(b'S')? | doubles(b'P')? | both,
    })
}
