//! The frame guard, and the stopwatch that it hangs on: TIM5 runs freely, its compare 1 is the guard's deadline.
//!
//! Control has three quarters of a frame time to answer a frame, and each answer moves the guard to the instant at
//! which the next one is due: one and three quarters frame times after this frame's end. When that passes, the
//! interrupt of the highest priority cuts the bridge, signals the control task, and sets the next deadline, so that
//! control runs on (without frames) and can see to the bridge, the watchdog and the scan's restart.
//!
//! # Watchdogs
//!
//! Two watchdogs stand behind the guard: one on the bus clock, which ends a hang within about a millisecond, and an
//! independent one behind it, which also sees that clock stop.
//!
//! The one on the bus clock is the window watchdog, with its window open. It resets between `count` and `count + 1`
//! of its ticks after it was fed, and cannot be stopped. So it starts after the long steps of a start, and each later
//! long operation first sets the longest time.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::timer::regs::SrGp16;
use embassy_stm32::pac::wwdg::vals::Wdgtb;
use embassy_stm32::peripherals::{IWDG, TIM5, WWDG};
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

/// Starts the guard: it trips `frames` times 1.75 frame times after the instant `from`.
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

/// Lets the guard rest until the next [`restart`], while no frames are to come and the motor is not driven.
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

/// Shortest time of the independent watchdog in its counts of 125 us: 12 ms by its nominal clock of 32 kHz, 8 to 23 ms
/// over that clock's tolerance, 17 to 47 kHz.
const INDEPENDENT_LEAST: u32 = 96;
/// Ticks of the scan's timer in a count at 47 kHz.
const INDEPENDENT_TICK: u32 = CLOCKS.timer_hz / 47_000 * 4;
/// A tick of the window watchdog at its quickest, in ticks of the scan's timer: 4096 of APB1, 97.5 us.
const WINDOW_TICK: u32 = 4_096 * 4;
/// Ticks for about a millisecond.
const WINDOW_TICKS_LEAST: u32 = 10;
/// The frame guard waits for seven frames' time after a start of the scan, and control feeds when it trips.
const FRAMES_TO_FEED: u32 = 8;
/// The counter bites when it falls below this.
const WINDOW_END: u8 = 0x40;
const WINDOW_COUNT_MAX: u32 = 0x3F;

/// The two watchdogs; once started, only the control task feeds them.
pub struct Watchdogs {
    count: u8,
}

impl Watchdogs {
    /// Neither runs yet.
    pub fn new(_independent: Peri<'static, IWDG>, _window: Peri<'static, WWDG>) -> Self {
        rcc::enable_and_reset::<WWDG>();
        Self { count: WINDOW_COUNT_MAX as u8 }
    }

    /// Starts both, with the longest time. [`Watchdogs::expect_frames`] follows at once.
    pub fn start(&mut self) {
        pac::IWDG.kr().write(|w| w.set_key(Key::START));
        self.allow_long();
    }

    /// Expects each frame to be answered in time. The window watchdog waits for 1 ms, or for eight frames where these
    /// take longer; the independent one for 12 ms, or for eight frames of its quickest clock.
    ///
    /// The independent one takes a new time after some cycles of its clock, 0.2 ms, and ignores another until then
    /// (RM0390, IWDG_SR). At the start it counts from 0.5 s until it is fed after that. Later the time changes with
    /// the parameters only, and a new configuration takes longer than that.
    pub fn expect_frames(&mut self, timing: ScanTiming) {
        let counts = (FRAMES_TO_FEED * timing.frame().0).div_ceil(INDEPENDENT_TICK).max(INDEPENDENT_LEAST);
        pac::IWDG.kr().write(|w| w.set_key(Key::ENABLE));
        pac::IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
        pac::IWDG.rlr().write(|w| w.set_rl(counts as u16));
        let ticks = (FRAMES_TO_FEED * timing.frame().0).div_ceil(WINDOW_TICK).max(WINDOW_TICKS_LEAST);
        let divider = (0u8..3).find(|divider| ticks >> divider < WINDOW_COUNT_MAX).unwrap_or(3);
        self.set(Wdgtb::from_bits(divider), (ticks >> divider) as u8 + u8::from(divider > 0));
    }

    /// Lets the window watchdog wait for as long as it can, 49 ms. The independent one bites after 8 ms at the
    /// earliest.
    pub fn allow_long(&mut self) {
        self.set(Wdgtb::DIV8, WINDOW_COUNT_MAX as u8);
    }

    fn set(&mut self, divider: Wdgtb, count: u8) {
        self.count = count.min(WINDOW_COUNT_MAX as u8);
        // The count first: the old one may be too short, and either may be longer.
        self.pet();
        pac::WWDG.cfr().write(|w| {
            w.set_w(WINDOW_END | WINDOW_COUNT_MAX as u8);
            w.set_wdgtb(divider);
        });
        self.pet();
    }

    /// Feeds both.
    pub fn pet(&mut self) {
        pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
        pac::WWDG.cr().write(|w| {
            w.set_t(WINDOW_END | self.count);
            w.set_wdga(true);
        });
    }
}
