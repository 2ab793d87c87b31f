//! The frame guard, and the stopwatch that it hangs on: TIM5 runs freely, its compare 1 is the guard's deadline.
//!
//! Control has three quarters of a frame time to answer a frame, and each answer moves the guard to the instant at
//! which the next one is due: one and three quarters frame times after this frame's end. When that passes, the
//! interrupt of the highest priority cuts the bridge, signals the control task, and sets the next deadline, so that
//! control runs on (without frames) and can see to the bridge, the watchdog and the scan's restart.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::timer::regs::SrGp16;
use embassy_stm32::peripherals::TIM5;
use embassy_stm32::{Peri, pac, rcc};
use fingertip::scan::ScanTiming;
use fingertip::shipped::CLOCKS;
use fingertip::units::CoreCycles;

use super::{bridge, scan, trace};

/// Ticks of the stopwatch in a second.
pub const HZ: u32 = 84_000_000;
/// The same in a microsecond.
pub const TICKS_PER_US: u32 = HZ / 1_000_000;

/// A time on the stopwatch: its ticks.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stopwatch(pub u32);

impl Stopwatch {
    /// Time from an instant to now.
    pub fn since(from: u32) -> Self {
        Self(now().wrapping_sub(from))
    }

    /// Time from the end of a frame to the deadline for the answer to the next one.
    const fn to_next_answer(timing: ScanTiming) -> Self {
        Self(frame(timing) + timing.deadline.0 / (CLOCKS.core_hz / HZ))
    }

    /// The same time in cycles of the core.
    pub const fn cycles(self) -> CoreCycles {
        CoreCycles(self.0.saturating_mul(CLOCKS.core_hz / HZ))
    }
}

const COMPARE_1: usize = 0;

static TRIPPED: AtomicBool = AtomicBool::new(false);
static PERIOD: AtomicU32 = AtomicU32::new(u32::MAX);

/// A frame's time on the stopwatch.
pub const fn frame(timing: ScanTiming) -> u32 {
    timing.frame().0 / (CLOCKS.timer_hz / HZ)
}

/// Starts the stopwatch; the guard waits for [`restart`].
pub fn start(_timer: Peri<'static, TIM5>) {
    rcc::enable_and_reset::<TIM5>();
    pac::TIM5.arr().write_value(u32::MAX);
    pac::TIM5.cr1().modify(|w| w.set_cen(true));
    // SAFETY: the handler below touches only statics and registers that are its own or written whole, and its priority
    // is set.
    unsafe { interrupt::TIM5.enable() };
}

/// The stopwatch; wraps after 51 s.
pub fn now() -> u32 {
    pac::TIM5.cnt().read()
}

/// Starts the guard: it trips after `frames` frames and the time to answer them, from the instant `from`.
pub fn restart(from: u32, frames: u32, timing: ScanTiming) {
    let period = frames * Stopwatch::to_next_answer(timing).0;
    PERIOD.store(period, Ordering::Relaxed);
    pac::TIM5.ccr(COMPARE_1).write_value(from.wrapping_add(period));
    if !pac::TIM5.dier().read().ccie(COMPARE_1) {
        // A match while the guard rested is void.
        clear_flag();
    }
    pac::TIM5.dier().write(|w| w.set_ccie(COMPARE_1, true));
    if now().wrapping_sub(from) >= period {
        // Too late: the counter has passed the new deadline already and would meet it only after a wrap.
        pac::TIM5.egr().write(|w| w.set_ccg(COMPARE_1, true));
    }
}

/// Lets the guard rest until the next [`restart`], while no frames are to come and the bridge is off.
pub fn rest() {
    pac::TIM5.dier().write(|w| w.set_ccie(COMPARE_1, false));
}

/// Returns true if the guard has tripped since [`take_trip`].
pub fn tripped() -> bool {
    TRIPPED.load(Ordering::Acquire)
}

/// Returns true if the guard has tripped, and clears that.
pub fn take_trip() -> bool {
    TRIPPED.swap(false, Ordering::AcqRel)
}

#[embassy_stm32::interrupt]
fn TIM5() {
    bridge::make_safe();
    trace::Pin::Guard.high();
    TRIPPED.store(true, Ordering::Release);
    clear_flag();
    pac::TIM5.ccr(COMPARE_1).write_value(now().wrapping_add(PERIOD.load(Ordering::Relaxed)));
    scan::WAKE.signal(());
}

/// Flags of the status register are cleared by writing 0 and left alone by writing 1.
fn clear_flag() {
    let mut cleared = SrGp16(u32::MAX);
    cleared.set_ccif(COMPARE_1, false);
    pac::TIM5.sr().write_value(cleared);
}
