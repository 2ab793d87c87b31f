//! The scan: rows, conversions and memory are moved by timers and DMA alone; see "Scan" in `docs/board.md`.
//!
//! The processor sees two interrupts a frame. That of the second bank's stream counts the frame, notes the instant and
//! wakes the control task. That of the rows' stream, when half of them are driven, wakes it for a check of the partial
//! frame. The two halves of the buffers take turns, so the lowest bit of the sequence number names the half.

use core::ops::Range;
use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, Ordering, fence};

use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::adc::Adc;
use embassy_stm32::pac::adc::vals::{Dds, Exten};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_stm32::peripherals::{ADC2, ADC3, DMA2_CH0, DMA2_CH1, DMA2_CH2, TIM8};
use embassy_stm32::{Peri, interrupt, pac, rcc};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use fingertip::frame::{BANKS, Codes};
use fingertip::scan::ScanTiming;
use fingertip::shipped::{BANK_COLUMNS, CLOCKS, COLUMNS, Frame, ROWS, SLOTS};

use super::health::{self, Broken};
use super::{analogue, guard, pins, trace};

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

/// Returns true if half of the rows were driven since the last call. While control runs, the interrupt waits and its flag
/// shows it.
pub fn take_halfway() -> bool {
    take_halfway_flag() || HALFWAY.swap(false, Ordering::AcqRel)
}

/// Takes the flag of the rows' stream.
fn take_halfway_flag() -> bool {
    let set = pac::DMA2.isr(0).read().htif(STREAM_ROWS);
    if set {
        pac::DMA2.ifcr(0).write(|w| w.set_htif(STREAM_ROWS, true));
    }
    set
}

/// The scan's hardware.
pub struct Scan {
    /// Number of the frame of which the first slots were copied before its end, and how many.
    early: (u32, usize),
}

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
        Self { early: (0, 0) }
    }

    /// Stops the timer first, which requests the DMA, then converters and streams. No row stays driven.
    pub fn stop(&mut self) {
        pac::TIM8.cr1().write(|w| w.set_cen(false));
        pac::TIM8.dier().write(|_| ());
        for adc in SCANNING {
            adc.cr2().write(|_| ());
            adc.sr().write(|_| ());
        }
        for stream in [STREAM_A, STREAM_ROWS, STREAM_B] {
            let stream = pac::DMA2.st(stream);
            stream.cr().modify(|w| w.set_en(false));
            // A transfer under way is finished first: a few cycles.
            while stream.cr().read().en() {}
        }
        pac::DMA2.ifcr(0).write(|w| {
            for stream in [STREAM_A, STREAM_ROWS, STREAM_B] {
                w.set_htif(stream, true);
                w.set_tcif(stream, true);
                w.set_teif(stream, true);
                w.set_dmeif(stream, true);
                w.set_feif(stream, true);
            }
        });
        interrupt::DMA2_STREAM1.unpend();
        interrupt::DMA2_STREAM2.unpend();
        pac::GPIOB.bsrr().write(|w| w.0 = ALL_PINS << 16);
    }

    /// Restarts from the first slot. The first frame must not be used: the converters have just woken.
    pub fn start(&mut self, timing: ScanTiming) {
        const { assert!(CLOCKS.frame_ns.is_none(), "this scan has no idle time") };
        self.stop();
        self.early = (0, 0);
        // Not before: the register belongs to ADC1, whose clock is on by now.
        analogue::set_clock();
        // First of the scan, while no converter listens: a compare that is set below the counter is a trigger.
        set_timer(timing);
        let time = analogue::sample_time(timing.sample_cycles);
        for (adc, channels) in SCANNING.into_iter().zip(CHANNELS) {
            start_converter(adc, || analogue::set_sequence(adc, channels, time));
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
        analogue::stabilise();
        start_timer();
    }

    /// Copies the frame, less the slots that [`Scan::copy_so_far`] copied: `frame` is the same one then, and unchanged
    /// since. Returns false if the frame is not whole: a bank is missing, banks and rows are out of step, or the DMA
    /// wrote to this half meanwhile.
    pub fn copy(&mut self, completed: Completed, frame: &mut Frame) -> bool {
        let half = completed.sequence as usize & 1;
        let arrived = bank_a_completed(half) && !overrun() && Progress::now().in_step();
        // Every copy discards the early rows: a late copy of the frame before has overwritten them.
        let (sequence, copied) = core::mem::take(&mut self.early);
        let first = if sequence == completed.sequence { copied } else { 0 };
        copy_slots(half, first..SLOTS, frame);
        frame.sequence = completed.sequence;
        let now = Progress::now();
        let untouched = !now.halves().contains(&half);
        // Twice: for the last part of a slot, banks that are one slot behind seem to be in step.
        let whole = arrived && untouched && now.in_step() && newest() == completed;
        if !whole {
            health::note_broken(what_broke(half));
        }
        whole
    }

    /// Replaces the first slots of `frame` by those that both banks have completed in the scan under way, and its number by
    /// that of this scan. Returns the number of rows.
    pub fn copy_so_far(&mut self, frame: &mut Frame) -> usize {
        // First: a number that is too old lets the whole frame be copied again.
        let sequence = newest().sequence.wrapping_add(1);
        let now = Progress::now();
        let [half_a, half_b] = now.halves();
        if half_a != half_b {
            return 0;
        }
        let stored = u32::min(now.stored[0] % HALF_LEN, now.stored[1] % HALF_LEN);
        let slots = stored as usize / BANK_COLUMNS;
        copy_slots(half_a, 0..slots, frame);
        frame.sequence = sequence;
        // A frame's lowest bit is its half.
        if sequence as usize & 1 != half_a {
            return 0;
        }
        self.early = (sequence, slots);
        slots.saturating_sub(1)
    }
}

/// Returns the defect of a frame that is not whole.
#[cold]
#[inline(never)]
fn what_broke(half: usize) -> Broken {
    note_transfers();
    if overrun() {
        Broken::Overrun
    } else if !bank_a_completed(half) {
        Broken::Bank
    } else if !Progress::now().in_step() {
        Broken::OutOfStep
    } else {
        Broken::Overwritten
    }
}

/// Counts the errors of the transfers since the last call.
pub fn note_transfers() {
    let flags = pac::DMA2.isr(0).read();
    let streams = [STREAM_A, STREAM_ROWS, STREAM_B];
    pac::DMA2.ifcr(0).write(|w| {
        for stream in streams {
            w.set_teif(stream, true);
            w.set_dmeif(stream, true);
            w.set_feif(stream, true);
        }
    });
    let any =
        |failed: fn(&pac::dma::regs::Ixr, usize) -> bool| streams.into_iter().any(|stream| failed(&flags, stream));
    let stream_failed = any(|flags, stream| flags.dmeif(stream) || flags.feif(stream));
    health::note_transfers(any(|flags, stream| flags.teif(stream)), stream_failed);
}

/// Copies slots of a half.
#[inline(never)]
fn copy_slots(half: usize, slots: Range<usize>, frame: &mut Frame) {
    let [bank_a, bank_b] = [&BUFFERS[0][half], &BUFFERS[1][half]];
    let Codes { rows, undriven } = &mut frame.codes;
    if slots.start == 0 {
        copy_slot([&bank_a[0], &bank_b[0]], undriven);
    }
    let driven = slots.start.max(1)..slots.end;
    if let (Some(a), Some(b)) = (bank_a.get(driven.clone()), bank_b.get(driven.clone())) {
        for ((a, b), row) in a.iter().zip(b).zip(rows.iter_mut().skip(driven.start - 1)) {
            copy_slot([a, b], row);
        }
    }
    fence(Ordering::Acquire);
}

#[inline(always)]
fn copy_slot([a, b]: [&[AtomicU16; BANK_COLUMNS]; BANKS], codes: &mut [u16; COLUMNS]) {
    lanes::each_pair::<COLUMNS>(|at| {
        let pair = [a[at].load(Ordering::Relaxed), b[at].load(Ordering::Relaxed)];
        (codes[2 * at], codes[2 * at + 1]) = pair.into();
    });
}

#[embassy_stm32::interrupt]
fn DMA2_STREAM1() {
    // Control may have taken it already.
    if take_halfway_flag() {
        HALFWAY.store(true, Ordering::Release);
        WAKE.signal(());
    }
}

#[embassy_stm32::interrupt]
fn DMA2_STREAM2() {
    let flags = pac::DMA2.isr(0).read();
    let (first, second) = (flags.htif(STREAM_B), flags.tcif(STREAM_B));
    if !first && !second {
        return;
    }
    // Where both halves came before this ran, the newest is the one that is not being written.
    let half = if first && second { 1 - Progress::now().halves()[1] } else { usize::from(second) };
    pac::DMA2.ifcr(0).write(|w| {
        w.set_htif(STREAM_B, first);
        w.set_tcif(STREAM_B, second);
        // Bank A's flag of the half that begins now: it must not show that half's last round.
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

/// TIM8's compare 1 in the converters' list of triggers.
const TRIGGER_TIM8_CC1: u8 = 13;
/// Streams of DMA2, with their channels: bank A, the rows, bank B.
const STREAM_A: usize = 0;
const STREAM_ROWS: usize = 1;
const STREAM_B: usize = 2;
const CHANNEL_ADC3: u8 = 2;
const CHANNEL_TIM8_UP: u8 = 7;
const CHANNEL_ADC2: u8 = 1;
/// The converters of bank A and bank B.
const SCANNING: [Adc; 2] = [pac::ADC3, pac::ADC2];

const HALF_LEN: u32 = (SLOTS * BANK_COLUMNS) as u32;
const BUFFER_LEN: u32 = 2 * HALF_LEN;

/// Words that the slots write to the port's set/reset register. The first slot resets all rows and sets the frame's
/// trace pin; each later one sets its row and resets all others.
///
/// Atomic so that it lies in RAM: a flash that is being programmed would make the DMA wait.
static ROW_WORDS: [AtomicU32; SLOTS] = {
    let mut words = [const { AtomicU32::new(0) }; SLOTS];
    let mut slot = 0;
    while slot < SLOTS {
        let set = if slot > 0 { 1 << (slot - 1) } else { 1 << trace::FRAME };
        words[slot] = AtomicU32::new((ALL_PINS & !set) << 16 | set);
        slot += 1;
    }
    words
};
/// The rows, and the frame's trace pin.
const ALL_PINS: u32 = ((1 << ROWS) - 1) | (1 << trace::FRAME);

fn start_converter(adc: Adc, set_sequence: impl FnOnce()) {
    adc.cr1().write(|w| w.set_scan(true));
    set_sequence();
    adc.cr2().write(|w| {
        w.set_adon(true);
        w.set_dma(true);
        w.set_dds(Dds::CONTINUOUS);
        w.set_exten(Exten::RISING_EDGE);
        w.set_extsel(TRIGGER_TIM8_CC1);
    });
}

/// A converter's results, round and round; the second bank's stream interrupts at each half.
fn start_stream(number: usize, channel: u8, from: u32, to: u32) {
    let stream = pac::DMA2.st(number);
    stream.par().write_value(from);
    stream.m0ar().write_value(to);
    stream.ndtr().write(|w| w.set_ndt(BUFFER_LEN as u16));
    stream.cr().write(|w| {
        w.set_chsel(channel);
        w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
        w.set_circ(true);
        w.set_minc(true);
        w.set_msize(Size::BITS16);
        w.set_psize(Size::BITS16);
        w.set_pl(Pl::VERY_HIGH);
        w.set_htie(number == STREAM_B);
        w.set_tcie(number == STREAM_B);
    });
    stream.cr().modify(|w| w.set_en(true));
}

fn start_rows() {
    let stream = pac::DMA2.st(STREAM_ROWS);
    stream.par().write_value(pac::GPIOB.bsrr().as_ptr() as u32);
    stream.m0ar().write_value(&raw const ROW_WORDS as u32);
    stream.ndtr().write(|w| w.set_ndt(SLOTS as u16));
    stream.cr().write(|w| {
        w.set_chsel(CHANNEL_TIM8_UP);
        w.set_dir(Dir::MEMORY_TO_PERIPHERAL);
        w.set_circ(true);
        w.set_minc(true);
        w.set_msize(Size::BITS32);
        w.set_psize(Size::BITS32);
        w.set_pl(Pl::HIGH);
        w.set_htie(true);
    });
    stream.cr().modify(|w| w.set_en(true));
}

/// The update moves the row; the compare's rising edge, a settle time later, triggers both converters. The second
/// channel is the same on the trigger's trace pin. Leaves the counter at 0, with the compare's output low.
fn set_timer(timing: ScanTiming) {
    let timer = pac::TIM8;
    timer.arr().write(|w| w.set_arr((timing.slot.0 - 1) as u16));
    for channel in 0..2 {
        timer.ccr(channel).write(|w| w.set_ccr(timing.settle.0 as u16));
    }
    timer.ccmr_output(0).write(|w| {
        for channel in 0..2 {
            w.set_ocm(channel, Ocm::PWM_MODE2);
            w.set_ocpe(channel, true);
        }
    });
    timer.ccer().write(|w| {
        w.set_cce(0, true);
        w.set_ccne(1, true);
    });
    timer.bdtr().write(|w| w.set_moe(true));
    timer.egr().write(|w| w.set_ug(true));
}

/// Starts the timer at the first slot.
fn start_timer() {
    let timer = pac::TIM8;
    timer.dier().write(|w| w.set_ude(true));
    timer.egr().write(|w| w.set_ug(true));
    timer.cr1().write(|w| w.set_cen(true));
}

/// Progress of the transfers at one time.
struct Progress {
    /// Slots whose row was driven before, in this frame and the one before.
    slots_before: u32,
    /// Codes that the streams of bank A and bank B have stored in this round through both halves.
    stored: [u32; BANKS],
}

impl Progress {
    #[inline(always)]
    fn now() -> Self {
        let left = |stream| u32::from(pac::DMA2.st(stream).ndtr().read().ndt());
        // The rows' count falls from the number of slots to 1. Its double keeps the difference above 0.
        let slots_before = 2 * SLOTS as u32 - 1 - left(STREAM_ROWS);
        let stored = |stream| BUFFER_LEN.wrapping_sub(left(stream));
        Self { slots_before, stored: [stored(STREAM_A), stored(STREAM_B)] }
    }

    /// The half of the buffer that each bank's stream writes to next.
    #[inline(always)]
    fn halves(&self) -> [usize; BANKS] {
        let half = |stored: u32| (stored / HALF_LEN) as usize & 1;
        [half(self.stored[0]), half(self.stored[1])]
    }

    /// Returns true if the codes belong to the rows under which they are stored.
    ///
    /// While slot n of a frame is set, each bank has completed n slots of this frame, or n + 1. A lost trigger leaves the
    /// banks behind the rows permanently; only a restart of the scan aligns them again.
    #[inline(always)]
    fn in_step(&self) -> bool {
        // A buffer's length keeps the differences above 0.
        let codes_before = self.slots_before * BANK_COLUMNS as u32;
        let fits = |stored: u32| (stored + BUFFER_LEN - codes_before) % HALF_LEN < 2 * BANK_COLUMNS as u32;
        fits(self.stored[0]) && fits(self.stored[1])
    }
}

/// Returns true if the first bank's stream, which does not interrupt, has completed this half too.
fn bank_a_completed(half: usize) -> bool {
    let flags = pac::DMA2.isr(0).read();
    if half == 0 { flags.htif(STREAM_A) } else { flags.tcif(STREAM_A) }
}

/// A converter that was not read in time stops asking for DMA.
fn overrun() -> bool {
    let overrun = |adc: Adc| adc.sr().read().ovr();
    overrun(SCANNING[0]) || overrun(SCANNING[1])
}
