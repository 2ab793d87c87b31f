//! The timer, the converters and the DMA streams that make a scan, and what their registers tell of it.

use core::sync::atomic::AtomicU32;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac;
use embassy_stm32::pac::adc::Adc;
use embassy_stm32::pac::adc::vals::{Dds, Exten};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::vals::Ocm;
use fingertip::scan::ScanTiming;
use fingertip::shipped::{BANK_COLUMNS, ROWS, SLOTS};

use super::trace;

/// TIM8's compare 1 in the converters' list of triggers.
pub const TRIGGER_TIM8_CC1: u8 = 13;
/// Streams of DMA2, with their channels: bank A, the rows, bank B.
pub const STREAM_A: usize = 0;
pub const STREAM_ROWS: usize = 1;
pub const STREAM_B: usize = 2;
pub const CHANNEL_ADC3: u8 = 2;
pub const CHANNEL_TIM8_UP: u8 = 7;
pub const CHANNEL_ADC2: u8 = 1;
/// The converters of bank A and bank B.
pub const SCANNING: [Adc; 2] = [pac::ADC3, pac::ADC2];

pub const HALF_LEN: u16 = (SLOTS * BANK_COLUMNS) as u16;
pub const BUFFER_LEN: u16 = 2 * HALF_LEN;

/// What each slot writes to the port's set/reset register: its row set, the others reset; in the last all rows reset,
/// and the frame's trace pin set.
///
/// Atomic so that it lies in RAM: a flash that is being programmed would make the DMA wait.
static ROW_WORDS: [AtomicU32; SLOTS] = {
    let mut words = [const { AtomicU32::new(0) }; SLOTS];
    let mut slot = 0;
    while slot < SLOTS {
        let set = if slot < ROWS { 1 << slot } else { 1 << trace::FRAME };
        words[slot] = AtomicU32::new((ALL_PINS & !set) << 16 | set);
        slot += 1;
    }
    words
};
/// The rows, and the frame's trace pin.
const ALL_PINS: u32 = ((1 << ROWS) - 1) | (1 << trace::FRAME);

/// Stops the timer first, so that nothing asks for DMA any more, then all that hung on it. No row stays driven.
pub fn stop() {
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

pub fn start_converter(adc: Adc, set_sequence: impl FnOnce()) {
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
pub fn start_stream(number: usize, channel: u8, from: u32, to: u32) {
    let stream = pac::DMA2.st(number);
    stream.par().write_value(from);
    stream.m0ar().write_value(to);
    stream.ndtr().write(|w| w.set_ndt(BUFFER_LEN));
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

pub fn start_rows() {
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
pub fn set_timer(timing: ScanTiming) {
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

/// From the first row.
pub fn start_timer() {
    let timer = pac::TIM8;
    timer.dier().write(|w| w.set_ude(true));
    timer.egr().write(|w| w.set_ug(true));
    timer.cr1().write(|w| w.set_cen(true));
}

/// Codes that a stream has stored in this round through both halves.
pub fn stored(stream: usize) -> u16 {
    BUFFER_LEN.wrapping_sub(pac::DMA2.st(stream).ndtr().read().ndt())
}

/// The half of the buffer that a stream writes to next.
pub fn written_half(stream: usize) -> usize {
    usize::from((stored(stream) / HALF_LEN) & 1)
}

/// Whether the codes belong to the rows under which they are stored.
///
/// In the slot that the rows' stream has set last, each bank has completed as many slots of the frame as came before
/// it, or one more. A trigger that was lost leaves the banks behind the rows for good; only a new start brings them
/// together.
pub fn in_step() -> bool {
    let slots = SLOTS as u16;
    let current = (2 * slots - pac::DMA2.st(STREAM_ROWS).ndtr().read().ndt() - 1) % slots;
    [STREAM_A, STREAM_B].into_iter().all(|stream| {
        let completed = stored(stream) / BANK_COLUMNS as u16 % slots;
        completed == current || completed == (current + 1) % slots
    })
}

/// Whether the first bank's stream, which does not interrupt, has completed this half too.
pub fn bank_a_completed(half: usize) -> bool {
    let flags = pac::DMA2.isr(0).read();
    if half == 0 { flags.htif(STREAM_A) } else { flags.tcif(STREAM_A) }
}

/// A converter that was not read in time stops asking for DMA.
pub fn overrun() -> bool {
    SCANNING.into_iter().any(|adc| adc.sr().read().ovr())
}

/// Whether a transfer failed on the memory's bus, and whether a stream failed, since the last time.
pub fn take_errors() -> (bool, bool) {
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
    (any(|flags, stream| flags.teif(stream)), any(|flags, stream| flags.dmeif(stream) || flags.feif(stream)))
}
