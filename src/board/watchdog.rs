//! Two watchdogs: one on the bus clock, which ends a hang within about a millisecond, and an independent one behind it,
//! which also sees that clock stop.
//!
//! The one on the bus clock is the window watchdog, with its window open. It resets between `count` and `count + 1`
//! of its ticks after it was fed, and cannot be stopped. So it starts after the long steps of a start, and each later
//! long operation first sets the longest time.

use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::wwdg::vals::Wdgtb;
use embassy_stm32::peripherals::{IWDG, WWDG};
use embassy_stm32::{Peri, rcc};
use fingertip::scan::ScanTiming;
use fingertip::shipped::CLOCKS;

/// Shortest time of the independent watchdog in its counts of 125 us: 12 ms by its nominal clock of 32 kHz, 8 to 23 ms
/// over that clock's tolerance, 17 to 47 kHz.
const INDEPENDENT_LEAST: u32 = 96;
/// Ticks of the scan's timer in a count at 47 kHz.
const INDEPENDENT_TICK: u32 = CLOCKS.timer_hz / 47_000 * 4;
/// A tick of the window watchdog at its quickest, in ticks of the scan's timer: 4096 of APB1, 97.5 us.
const TICK: u32 = 4_096 * 4;
/// Ticks for about a millisecond.
const LEAST: u32 = 10;
/// The frame guard waits for seven frames' time after a start of the scan, and control feeds when it trips.
const FRAMES: u32 = 8;
/// The counter bites when it falls below this.
const END: u8 = 0x40;
const LARGEST: u32 = 0x3F;

/// The two, once started fed by the control task alone.
pub struct Watchdogs {
    count: u8,
}

impl Watchdogs {
    /// Neither runs yet.
    pub fn new(_independent: Peri<'static, IWDG>, _window: Peri<'static, WWDG>) -> Self {
        rcc::enable_and_reset::<WWDG>();
        Self { count: LARGEST as u8 }
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
        let counts = (FRAMES * timing.frame().0).div_ceil(INDEPENDENT_TICK).max(INDEPENDENT_LEAST);
        pac::IWDG.kr().write(|w| w.set_key(Key::ENABLE));
        pac::IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
        pac::IWDG.rlr().write(|w| w.set_rl(counts as u16));
        let ticks = (FRAMES * timing.frame().0).div_ceil(TICK).max(LEAST);
        let divider = (0u8..3).find(|divider| ticks >> divider < LARGEST).unwrap_or(3);
        self.set(Wdgtb::from_bits(divider), (ticks >> divider) as u8 + u8::from(divider > 0));
    }

    /// Lets the window watchdog wait for as long as it can, 49 ms. The independent one bites after 8 ms at the
    /// earliest.
    pub fn allow_long(&mut self) {
        self.set(Wdgtb::DIV8, LARGEST as u8);
    }

    fn set(&mut self, divider: Wdgtb, count: u8) {
        self.count = count.min(LARGEST as u8);
        // The count first: the old one may be too short, and either may be longer.
        self.pet();
        pac::WWDG.cfr().write(|w| {
            w.set_w(END | LARGEST as u8);
            w.set_wdgtb(divider);
        });
        self.pet();
    }

    /// Feeds both.
    pub fn pet(&mut self) {
        pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
        pac::WWDG.cr().write(|w| {
            w.set_t(END | self.count);
            w.set_wdga(true);
        });
    }
}
