//! A converter's sequences as its registers describe them: the inputs in their order, and for how long each is sampled.
//!
//! The injected group follows each regular sequence automatically. It is no separate event: its words appear in their
//! registers when the core reads them after the last conversion.

use rigless::device::RegisterFile;
use rigless::soc::stm32f427::generated::adc1::{Register, cr1, jsqr, sqr1, sr};

/// Cycles of a 12-bit conversion after sampling, RM0090 13.7.
pub const CONVERSION_CYCLES: u64 = 12;
/// The most that a sequence has.
pub const RANKS: usize = 16;

/// `SMPx`, 13.13.4, in converter cycles.
const SAMPLING_CYCLES: [u64; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

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
    // Six ranks of five bits in a register, the last register first.
    let register = [Register::Sqr3, Register::Sqr2, Register::Sqr1][rank / 6 % 3];
    (registers.get(register) >> (5 * (rank % 6)) & 0b1_1111) as usize
}

/// Converter cycles for which an input is sampled.
pub fn sampling_cycles(registers: &RegisterFile, input: usize) -> u64 {
    let (register, place) = if input < 10 { (Register::Smpr2, input) } else { (Register::Smpr1, input - 10) };
    SAMPLING_CYCLES[(registers.get(register) >> (3 * place) & 0b111) as usize]
}

/// Data registers of the injected group.
const DATA: [Register; 4] = [Register::Jdr1, Register::Jdr2, Register::Jdr3, Register::Jdr4];

/// Inputs of the injected group in their order. A group of fewer than four uses the last places (RM0390, ADC_JSQR).
pub fn injected_inputs(registers: &RegisterFile) -> Vec<usize> {
    let sequence = registers.get(Register::Jsqr);
    let places = [jsqr::JSQ1, jsqr::JSQ2, jsqr::JSQ3, jsqr::JSQ4];
    places[3 - jsqr::JL.get(sequence) as usize..].iter().map(|place| place.get(sequence) as usize).collect()
}

/// Words of a group under way.
#[derive(Clone, Debug, Default)]
pub struct Injected {
    words: Vec<u16>,
    done_ns: u64,
}

impl Injected {
    /// These words, done at an instant.
    pub fn new(words: Vec<u16>, done_ns: u64) -> Self {
        Self { words, done_ns }
    }

    /// Returns true while conversions run.
    pub fn runs(&self, now_ns: u64) -> bool {
        now_ns < self.done_ns
    }

    /// Updates the completed conversions, and their flag in a status.
    pub fn show(&mut self, now_ns: u64, status: u64, registers: &mut RegisterFile) -> u64 {
        if self.runs(now_ns) || self.words.is_empty() {
            return status;
        }
        for (register, word) in DATA.into_iter().zip(self.words.drain(..)) {
            registers.set(register, word.into());
        }
        sr::JEOC.set(status, 1)
    }
}
