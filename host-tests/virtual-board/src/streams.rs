//! DMA2 as the scan uses it: converters to memory, memory to the row drives.
//!
//! The crate's own controller moves one item a request and an access at a time, which costs more than all else in a
//! scan. This one takes a whole sequence's words at once and writes them in one go. Modelled: direct mode, circular or
//! not, the requests below, half and full transfer, transfer errors, the registers' protection while a stream runs.
//! Asking for more is told to the run.

use crate::front_end::Shared;
use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32f427::generated::dma2::{Register, s0cr, s0fcr};
use rigless::soc::stm32f427::generated::{ADC2, ADC3};
use rigless::soc::stm32f427::peripherals::{CONVERTERS, adc, tim};
use rigless::soc::{Layout, Width};
use std::collections::VecDeque;

/// The stream whose interrupt says that a frame is complete.
const SCAN_STREAM: usize = 2;
/// A converter's data register, by its offset: to write to it is what triggers it in a scene.
const DATA_REGISTER: u64 = 0x4c;
/// An access's token: the stream, and whether it was the read of a word on its way to a peripheral.
const FETCH: u64 = 0x100;

#[derive(Clone, Copy, Debug, Default)]
struct Stream {
    /// Items of a round, and how many of them are still to come.
    items: u64,
    left: u64,
    /// Registers as they were when the stream began.
    control: u64,
    peripheral: u64,
    memory: u64,
    running: bool,
    interrupt: bool,
}

#[derive(Debug)]
pub struct Streams {
    streams: [Stream; STREAMS],
    front_end: Shared,
}

impl Streams {
    /// Out of reset.
    pub fn new(front_end: Shared) -> Self {
        Self { streams: [Stream::default(); STREAMS], front_end }
    }

    fn begin(&mut self, stream: usize, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if !fits(registers, stream) {
            context.tell("SxCR", "of DMA2 only converters to memory and memory to the row drives are modelled");
            return;
        }
        let items = get(registers, stream, Row::Count) & 0xffff;
        let state = &mut self.streams[stream];
        (state.items, state.left, state.running) = (items, items, items > 0);
        state.control = get(registers, stream, Row::Control);
        state.peripheral = get(registers, stream, Row::Peripheral);
        state.memory = get(registers, stream, Row::Memory0);
        match source(registers, stream) {
            Some(Source::Converter(nth)) => self.take_words(stream, nth, registers, context),
            Some(Source::ScanTimer) => {
                if let Some(scan) = &mut self.front_end.lock().scan {
                    (scan.words, scan.due_ns) = ([0, items as usize], VecDeque::new());
                }
            }
            None => {}
        }
    }

    fn take_words(&mut self, stream: usize, nth: usize, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let shared = self.front_end.clone();
        let mut front_end = shared.lock();
        let waiting = &mut front_end.waiting[nth];
        while self.streams[stream].running && !waiting.is_empty() {
            let at = self.streams[stream].next_address(2);
            let room = self.streams[stream].left as usize;
            let (count, width) = match waiting.len().min(room) {
                4.. => (4, Width::W64),
                2..4 => (2, Width::W32),
                _ => (1, Width::W16),
            };
            let words = waiting.drain(..count).enumerate();
            let value = words.fold(0, |value, (place, word)| value | u64::from(word) << (16 * place));
            context.write_to(at, width, value, stream as u64);
            self.count(stream, count as u64, registers);
        }
    }

    /// In a scene: begins a slot of both converters by a row's word, and requests the next one if updates have passed.
    fn begin_slot(&mut self, stream: usize, word: u64, context: &mut DeviceContext<'_>) -> bool {
        let state = &self.streams[stream];
        let mut front_end = self.front_end.lock();
        front_end.begin_slot(word, [(state.items - state.left) as usize, state.items as usize]);
        let Some(scan) = &front_end.scan else { return false };
        for converter in [ADC3, ADC2] {
            context.write_to(converter.base + DATA_REGISTER, Width::W32, 0, stream as u64);
        }
        if !scan.due_ns.is_empty() && state.running {
            context.read_from(state.next_address(4), Width::W32, stream as u64 | FETCH);
        }
        true
    }

    fn count(&mut self, stream: usize, items: u64, registers: &mut RegisterFile) {
        let state = &mut self.streams[stream];
        let before = state.items - state.left;
        state.left -= items;
        let half = state.items / 2;
        let mut flags = if before < half && before + items >= half { HALF } else { 0 };
        if state.left == 0 {
            flags |= COMPLETE;
            if s0cr::CIRC.is_set(state.control) {
                state.left = state.items;
            } else {
                self.stop(stream, registers);
            }
        }
        raise(registers, stream, flags);
        registers.set(register(stream, Row::Count), self.streams[stream].left);
    }

    fn stop(&mut self, stream: usize, registers: &mut RegisterFile) {
        self.streams[stream].running = false;
        let control = get(registers, stream, Row::Control);
        registers.set(register(stream, Row::Control), s0cr::EN.set(control, 0));
    }

    fn refresh(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let lost = self.front_end.lock().scan_interrupt_lost;
        for (stream, state) in self.streams.iter_mut().enumerate() {
            let (register, shift) = status(stream);
            let flags = registers.get(register) >> shift;
            let control = get(registers, stream, Row::Control);
            let asked = (s0cr::TCIE.is_set(control) && flags & COMPLETE != 0)
                || (s0cr::HTIE.is_set(control) && flags & HALF != 0)
                || (s0cr::TEIE.is_set(control) && flags & TRANSFER_ERROR != 0);
            let wanted = asked && !(lost && stream == SCAN_STREAM);
            if wanted != state.interrupt {
                state.interrupt = wanted;
                context.interrupt(stream, Level::from(wanted));
            }
        }
    }

    fn write_control(&mut self, stream: usize, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let written = get(registers, stream, Row::Control);
        if !self.streams[stream].running {
            if s0cr::EN.is_set(written) {
                self.begin(stream, registers, context);
            }
            return;
        }
        // While it runs only the enables can be changed.
        let free = [s0cr::EN, s0cr::TEIE, s0cr::HTIE, s0cr::TCIE, s0cr::DMEIE];
        let mask = free.iter().fold(0, |mask, field| mask | field.mask());
        let control = self.streams[stream].control & !mask | written & mask;
        registers.set(register(stream, Row::Control), control);
        self.streams[stream].control = control;
        if !s0cr::EN.is_set(control) {
            self.streams[stream].running = false;
            raise(registers, stream, COMPLETE);
        }
    }
}

impl Stream {
    fn next_address(&self, item_bytes: u64) -> u64 {
        self.memory + item_bytes * (self.items - self.left)
    }
}

impl Device for Streams {
    type Register = Register;

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if change.level == Level::Low {
            return;
        }
        let wanted = match (change.instance, change.request) {
            ("TIM8", tim::UPDATE_REQUEST) => Source::ScanTimer,
            (name, adc::DMA_REQUEST) if let Some(nth) = CONVERTERS.iter().position(|of| *of == name) => {
                Source::Converter(nth)
            }
            _ => return,
        };
        let asked = |stream: &usize| self.streams[*stream].running && source(registers, *stream) == Some(wanted);
        let Some(stream) = (0..STREAMS).find(asked) else { return };
        match wanted {
            Source::Converter(nth) => {
                self.take_words(stream, nth, registers, context);
                self.refresh(registers, context);
            }
            // In a scene one request covers all updates that passed.
            Source::ScanTimer if self.front_end.lock().scan.as_ref().is_some_and(|scan| scan.due_ns.is_empty()) => {}
            Source::ScanTimer => {
                context.read_from(self.streams[stream].next_address(4), Width::W32, stream as u64 | FETCH);
            }
        }
    }

    fn on_access(&mut self, token: u64, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let stream = (token & !FETCH) as usize;
        if token & FETCH != 0 && self.streams[stream].running {
            self.count(stream, 1, registers);
            if !self.begin_slot(stream, value, context) {
                context.write_to(self.streams[stream].peripheral, Width::W32, value, token & !FETCH);
            }
            self.refresh(registers, context);
        }
    }

    fn on_refused(&mut self, token: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let stream = (token & !FETCH) as usize;
        self.stop(stream, registers);
        raise(registers, stream, TRANSFER_ERROR);
        self.refresh(registers, context);
    }

    fn read(&mut self, read: Register, _registers: &mut RegisterFile, _context: &mut DeviceContext<'_>) -> Option<u64> {
        let of_stream = read.index().checked_sub(FIRST_ROW).map(|row| row % STREAM_ROWS);
        if of_stream == Some(Row::Count as usize)
            && let Some(scan) = &mut self.front_end.lock().scan
        {
            scan.looked = true;
        }
        None
    }

    fn write(&mut self, written: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let row = written.index();
        match written {
            Register::Lifcr | Register::Hifcr => {
                let flags = if written == Register::Lifcr { Register::Lisr } else { Register::Hisr };
                registers.set(flags, registers.get(flags) & !value);
                registers.set(written, 0);
            }
            _ if row >= FIRST_ROW => {
                let stream = (row - FIRST_ROW) / STREAM_ROWS;
                let state = self.streams[stream];
                match (row - FIRST_ROW) % STREAM_ROWS {
                    0 => self.write_control(stream, registers, context),
                    1 if state.running => registers.set(written, state.left),
                    2 if state.running => registers.set(written, state.peripheral),
                    3 if state.running => registers.set(written, state.memory),
                    _ => {}
                }
            }
            _ => {}
        }
        self.refresh(registers, context);
    }

    fn reset(&mut self) {
        *self = Self::new(self.front_end.clone());
    }
}

// The registers as the streams have them, and who may ask on which stream.

const STREAMS: usize = 8;
/// Registers of a stream, and the first stream's first.
const STREAM_ROWS: usize = 6;
const FIRST_ROW: usize = 4;
const TRANSFER_ERROR: u64 = 1 << 3;
const HALF: u64 = 1 << 4;
const COMPLETE: u64 = 1 << 5;
/// First bit of each stream's flags, RM0390 9.5.1.
const FLAG_SHIFT: [u32; 4] = [0, 6, 16, 22];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// A converter: its words wait.
    Converter(usize),
    /// TIM8: a row's word is to be moved.
    ScanTimer,
}

/// A stream's registers that matter, by their place among its six.
#[derive(Clone, Copy)]
enum Row {
    Control = 0,
    Count = 1,
    Peripheral = 2,
    Memory0 = 3,
    Fifo = 5,
}

fn register(stream: usize, row: Row) -> Register {
    Register::from_index(FIRST_ROW + STREAM_ROWS * stream + row as usize).expect("eight streams of six registers")
}

fn get(registers: &RegisterFile, stream: usize, row: Row) -> u64 {
    registers.get(register(stream, row))
}

/// Register of a stream's flags, and their first bit in it.
fn status(stream: usize) -> (Register, u32) {
    (if stream < 4 { Register::Lisr } else { Register::Hisr }, FLAG_SHIFT[stream % 4])
}

fn raise(registers: &mut RegisterFile, stream: usize, flags: u64) {
    let (register, shift) = status(stream);
    registers.set(register, registers.get(register) | flags << shift);
}

/// Who asks on a stream, by its channel: the rows of RM0390 table 29 that the scan uses.
fn source(registers: &RegisterFile, stream: usize) -> Option<Source> {
    match (stream, s0cr::CHSEL.get(get(registers, stream, Row::Control))) {
        (0, 2) => Some(Source::Converter(2)),
        (2, 1) => Some(Source::Converter(1)),
        (1, 7) => Some(Source::ScanTimer),
        _ => None,
    }
}

/// Returns true if the setup of a stream is modelled.
fn fits(registers: &RegisterFile, stream: usize) -> bool {
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
