//! What a converter's registers say of its regular sequence: which input comes when, and for how long it is sampled.

use rigless::device::RegisterFile;
use rigless::soc::FieldSpec;
use rigless::soc::stm32f427::generated::adc1::{Register, cr1, sqr1, sqr2, sqr3};

/// Cycles of a 12-bit conversion after sampling, RM0090 13.7.
pub const CONVERSION_CYCLES: u64 = 12;
/// The most that a sequence has.
pub const RANKS: usize = 16;

/// `SMPx`, 13.13.4, in converter cycles.
const SAMPLING_CYCLES: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

const SEQUENCE: [(Register, &FieldSpec); RANKS] = [
    (Register::Sqr3, sqr3::SQ1),
    (Register::Sqr3, sqr3::SQ2),
    (Register::Sqr3, sqr3::SQ3),
    (Register::Sqr3, sqr3::SQ4),
    (Register::Sqr3, sqr3::SQ5),
    (Register::Sqr3, sqr3::SQ6),
    (Register::Sqr2, sqr2::SQ7),
    (Register::Sqr2, sqr2::SQ8),
    (Register::Sqr2, sqr2::SQ9),
    (Register::Sqr2, sqr2::SQ10),
    (Register::Sqr2, sqr2::SQ11),
    (Register::Sqr2, sqr2::SQ12),
    (Register::Sqr1, sqr1::SQ13),
    (Register::Sqr1, sqr1::SQ14),
    (Register::Sqr1, sqr1::SQ15),
    (Register::Sqr1, sqr1::SQ16),
];

/// Conversions of a regular sequence.
pub fn length(registers: &RegisterFile) -> usize {
    if cr1::SCAN.is_set(registers.get(Register::Cr1)) {
        sqr1::L.get(registers.get(Register::Sqr1)) as usize + 1
    } else {
        1
    }
}

/// The input that a rank converts.
pub fn input(registers: &RegisterFile, rank: usize) -> usize {
    let (register, field) = SEQUENCE[rank % RANKS];
    field.get(registers.get(register)) as usize
}

/// Converter cycles for which an input is sampled.
pub fn sampling_cycles(registers: &RegisterFile, input: usize) -> u64 {
    let (register, place) = if input < 10 { (Register::Smpr2, input) } else { (Register::Smpr1, input - 10) };
    SAMPLING_CYCLES[(registers.get(register) >> (3 * place) & 0b111) as usize]
}
