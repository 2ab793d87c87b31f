//! The controller's registers as its streams have them, and who may ask on which stream.

use rigless::device::RegisterFile;
use rigless::soc::Layout;
use rigless::soc::stm32f427::generated::dma2::{Register, s0cr, s0fcr};

pub const STREAMS: usize = 8;
/// Registers of a stream, and the first stream's first.
pub const STREAM_ROWS: usize = 6;
pub const FIRST_ROW: usize = 4;
/// A stream's flags in the status registers.
pub const TRANSFER_ERROR: u64 = 1 << 3;
pub const HALF: u64 = 1 << 4;
pub const COMPLETE: u64 = 1 << 5;
/// First bit of each stream's flags, RM0390 9.5.1.
const FLAG_SHIFT: [u32; 4] = [0, 6, 16, 22];

/// Source of a DMA request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A converter: its words wait.
    Converter(usize),
    /// TIM8: a row's word is to be moved.
    ScanTimer,
}

/// Stream, channel, who asks there: the rows of RM0390 table 29 that are wired.
pub const REQUESTS: [(usize, u64, Source); 7] = [
    (0, 0, Source::Converter(0)),
    (4, 0, Source::Converter(0)),
    (2, 1, Source::Converter(1)),
    (3, 1, Source::Converter(1)),
    (0, 2, Source::Converter(2)),
    (1, 2, Source::Converter(2)),
    (1, 7, Source::ScanTimer),
];

/// A stream's registers that matter, by their place among its six.
#[derive(Clone, Copy)]
pub enum Row {
    Control = 0,
    Count = 1,
    Peripheral = 2,
    Memory0 = 3,
    Fifo = 5,
}

/// A stream's register.
pub fn register(stream: usize, row: Row) -> Register {
    Register::from_index(FIRST_ROW + STREAM_ROWS * stream + row as usize).expect("eight streams of six registers")
}

/// Value of a stream's register.
pub fn get(registers: &RegisterFile, stream: usize, row: Row) -> u64 {
    registers.get(register(stream, row))
}

/// Register of a stream's flags, and their first bit in it.
pub fn status(stream: usize) -> (Register, u32) {
    (if stream < 4 { Register::Lisr } else { Register::Hisr }, FLAG_SHIFT[stream % 4])
}

/// Sets flags of a stream.
pub fn raise(registers: &mut RegisterFile, stream: usize, flags: u64) {
    let (register, shift) = status(stream);
    registers.set(register, registers.get(register) | flags << shift);
}

/// Who asks on a stream, by its channel.
pub fn source(registers: &RegisterFile, stream: usize) -> Option<Source> {
    let channel = s0cr::CHSEL.get(get(registers, stream, Row::Control));
    REQUESTS.iter().find(|(at, on, _)| *at == stream && *on == channel).map(|(_, _, source)| *source)
}

/// Returns true if the setup of a stream is modelled.
pub fn fits(registers: &RegisterFile, stream: usize) -> bool {
    let control = get(registers, stream, Row::Control);
    let plain = s0cr::MINC.is_set(control)
        && !s0cr::PINC.is_set(control)
        && !s0cr::DBM.is_set(control)
        && !s0cr::PFCTRL.is_set(control)
        && !s0fcr::DMDIS.is_set(get(registers, stream, Row::Fifo));
    let shape = (s0cr::DIR.get(control), s0cr::PSIZE.get(control));
    plain
        && match source(registers, stream) {
            Some(Source::Converter(_)) => shape == (0, 1),
            Some(Source::ScanTimer) => shape == (1, 2),
            None => false,
        }
}
