//! The scan: rows, conversions and memory are moved by timers and DMA alone; see "Scan" in `docs/board.md`.
//!
//! The processor sees one interrupt a frame, from the second bank's stream. It counts the frame, notes the instant and
//! wakes the control task. Another, from the rows' stream when half of them are driven, wakes it for a check of the
//! partial frame. The two halves of the buffers take turns, so the lowest bit of the sequence number names the half.

mod machine;

use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, Ordering, fence};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::peripherals::{ADC2, ADC3, DMA2_CH0, DMA2_CH1, DMA2_CH2, TIM8};
use embassy_stm32::{Peri, pac, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use fingertip::frame::BANKS;
use fingertip::scan::ScanTiming;
use fingertip::shipped::{BANK_COLUMNS, CLOCKS, COLUMNS, Frame, SLOTS};

use super::health::{self, Broken};
use super::{converter, guard, pins, trace};
use machine::*;

/// Wakes the control task: a frame is complete or half complete, or the guard tripped.
pub static WAKE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Columns 0 to 4 on ADC3 and 5 to 9 on ADC2: the inputs of the pins that [`pins::of_scan`] takes.
const CHANNELS: [[u8; BANK_COLUMNS]; BANKS] = [[1, 10, 11, 12, 13], [4, 6, 7, 14, 15]];

/// Two frames of one bank, as the DMA writes them.
type Buffer = [[[AtomicU16; BANK_COLUMNS]; SLOTS]; 2];
static BUFFERS: [Buffer; BANKS] =
    [const { [const { [const { [const { AtomicU16::new(0) }; BANK_COLUMNS] }; SLOTS] }; 2] }; BANKS];

static SEQUENCE: AtomicU32 = AtomicU32::new(1);
static STAMP: AtomicU32 = AtomicU32::new(0);
static HALFWAY: AtomicBool = AtomicBool::new(false);

/// A frame that lies complete in memory.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Completed {
    /// Counts frames, missed ones too; wraps. Its lowest bit is the half of the buffers.
    pub sequence: u32,
    /// The stopwatch at the frame's end.
    pub stamp: u32,
}

/// The newest frame.
pub fn newest() -> Completed {
    loop {
        let sequence = SEQUENCE.load(Ordering::Acquire);
        let stamp = STAMP.load(Ordering::Acquire);
        if SEQUENCE.load(Ordering::Acquire) == sequence {
            return Completed { sequence, stamp };
        }
    }
}

/// Whether half of the rows were driven since the last call.
pub fn take_halfway() -> bool {
    HALFWAY.swap(false, Ordering::AcqRel)
}

/// The scan's hardware.
pub struct Scan(());

impl Scan {
    /// Takes the hardware; nothing moves yet.
    pub fn new(
        _timer: Peri<'static, TIM8>,
        _converters: (Peri<'static, ADC3>, Peri<'static, ADC2>),
        _streams: (Peri<'static, DMA2_CH0>, Peri<'static, DMA2_CH1>, Peri<'static, DMA2_CH2>),
        (rows, columns): pins::OfScan,
    ) -> Self {
        pins::rows(rows);
        pins::analog(columns);
        rcc::enable_and_reset::<TIM8>();
        rcc::enable_and_reset::<ADC3>();
        rcc::enable_and_reset::<ADC2>();
        Self(())
    }

    /// Stops, with no row driven.
    pub fn stop(&mut self) {
        stop();
    }

    /// Starts anew from the first row. The first frame is not to be used: the converters have just woken.
    pub fn start(&mut self, timing: ScanTiming) {
        const { assert!(CLOCKS.frame_ns.is_none(), "this scan has no idle time") };
        stop();
        // Not before: the register is the first converter's, whose clock is on by now.
        converter::set_clock();
        // First of the scan, while no converter listens: a compare that is set below the counter is a trigger.
        set_timer(timing);
        let time = converter::sample_time(timing.sample_cycles);
        for (adc, channels) in SCANNING.into_iter().zip(CHANNELS) {
            start_converter(adc, || converter::set_sequence(adc, channels, time));
        }
        // The next frame fills the first half: its number must be even.
        SEQUENCE.store(SEQUENCE.load(Ordering::Relaxed) | 1, Ordering::Release);
        start_stream(STREAM_A, CHANNEL_ADC3, pac::ADC3.dr().as_ptr() as u32, &raw const BUFFERS[0] as u32);
        start_stream(STREAM_B, CHANNEL_ADC2, pac::ADC2.dr().as_ptr() as u32, &raw const BUFFERS[1] as u32);
        start_rows();
        // SAFETY: the handlers below touch only atomics and flags of their own streams, and their priority is set.
        unsafe {
            interrupt::DMA2_STREAM1.enable();
            interrupt::DMA2_STREAM2.enable();
        }
        converter::stabilise();
        start_timer();
    }

    /// Copies the frame, or says that it is not whole: a bank is missing, the banks and the rows are out of step, or
    /// the DMA was in this half meanwhile.
    pub fn copy(&mut self, completed: Completed, frame: &mut Frame) -> bool {
        let half = completed.sequence as usize & 1;
        let arrived = bank_a_completed(half) && !overrun() && in_step();
        copy_slots(half, SLOTS, frame);
        frame.sequence = completed.sequence;
        let untouched = [STREAM_A, STREAM_B].into_iter().all(|stream| written_half(stream) != half);
        let whole = arrived && untouched && in_step() && newest() == completed;
        if !whole {
            health::note_broken(what_broke(half));
        }
        whole
    }

    /// Replaces the slots of `frame` that the scan has already read anew.
    pub fn copy_so_far(&mut self, frame: &mut Frame) {
        let [half_a, half_b] = [STREAM_A, STREAM_B].map(written_half);
        if half_a == half_b {
            let stored = u16::min(stored(STREAM_A) % HALF_LEN, stored(STREAM_B) % HALF_LEN);
            copy_slots(half_a, usize::from(stored) / BANK_COLUMNS, frame);
        }
    }
}

/// What is wrong with a frame that is not whole.
#[cold]
#[inline(never)]
fn what_broke(half: usize) -> Broken {
    note_transfers();
    if overrun() {
        Broken::Overrun
    } else if !bank_a_completed(half) {
        Broken::Bank
    } else if !in_step() {
        Broken::OutOfStep
    } else {
        Broken::Overwritten
    }
}

/// Counts what went wrong with the transfers since the last time.
pub fn note_transfers() {
    let (bus, stream) = take_errors();
    health::note_transfers(bus, stream);
}

/// Copies the first slots of a half.
#[inline(never)]
fn copy_slots(half: usize, slots: usize, frame: &mut Frame) {
    let banks = BUFFERS[0][half].iter().zip(&BUFFERS[1][half]);
    for (slot, (bank_a, bank_b)) in banks.enumerate().take(slots) {
        let Some(codes) = frame.codes.slot_mut(slot) else { break };
        lanes::each_pair::<COLUMNS>(|at| {
            let pair = [bank_a[at].load(Ordering::Relaxed), bank_b[at].load(Ordering::Relaxed)];
            (codes[2 * at], codes[2 * at + 1]) = pair.into();
        });
    }
    fence(Ordering::Acquire);
}

#[embassy_stm32::interrupt]
fn DMA2_STREAM1() {
    pac::DMA2.ifcr(0).write(|w| w.set_htif(STREAM_ROWS, true));
    HALFWAY.store(true, Ordering::Release);
    WAKE.signal(());
}

#[embassy_stm32::interrupt]
fn DMA2_STREAM2() {
    let flags = pac::DMA2.isr(0).read();
    let (first, second) = (flags.htif(STREAM_B), flags.tcif(STREAM_B));
    if !first && !second {
        return;
    }
    // Where both halves came before this ran, the newest is the one that is not being written.
    let half = if first && second { 1 - written_half(STREAM_B) } else { usize::from(second) };
    pac::DMA2.ifcr(0).write(|w| {
        w.set_htif(STREAM_B, first);
        w.set_tcif(STREAM_B, second);
        // The half that comes next has yet to be completed by the first bank's stream.
        w.set_htif(STREAM_A, half == 1);
        w.set_tcif(STREAM_A, half == 0);
    });
    // The next number whose lowest bit is this half; a frame that was missed whole leaves a gap.
    let next = SEQUENCE.load(Ordering::Relaxed).wrapping_add(1);
    let sequence = next.wrapping_add((next ^ half as u32) & 1);
    STAMP.store(guard::now(), Ordering::Release);
    SEQUENCE.store(sequence, Ordering::Release);
    WAKE.signal(());
}
