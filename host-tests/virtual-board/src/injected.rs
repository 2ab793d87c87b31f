//! The injected group of a converter as the image has it: behind each regular sequence, by itself. It is no event of its
//! own: the words show in their registers to whoever looks after the last of them is done.

use rigless::device::RegisterFile;
use rigless::soc::stm32f427::generated::adc1::{Register, jsqr, sr};
use serde::{Deserialize, Serialize};

const DATA: [Register; 4] = [Register::Jdr1, Register::Jdr2, Register::Jdr3, Register::Jdr4];

/// The group's inputs in their order: of fewer than four the last places are taken (RM0390, ADC_JSQR).
pub fn inputs(registers: &RegisterFile) -> Vec<usize> {
    let sequence = registers.get(Register::Jsqr);
    let places = [jsqr::JSQ1, jsqr::JSQ2, jsqr::JSQ3, jsqr::JSQ4];
    places[3 - jsqr::JL.get(sequence) as usize..].iter().map(|place| place.get(sequence) as usize).collect()
}

/// Words of a group under way.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Injected {
    words: Vec<u16>,
    done_ns: u64,
}

impl Injected {
    /// These words, done at an instant.
    pub fn new(words: Vec<u16>, done_ns: u64) -> Self {
        Self { words, done_ns }
    }

    /// Whether conversions are under way.
    pub fn runs(&self, now_ns: u64) -> bool {
        now_ns < self.done_ns
    }

    /// Shows what is done by now, and the flag of it in a status.
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
