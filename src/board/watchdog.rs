//! Two watchdogs: one on the bus clock, which ends a hang within about a millisecond, and an independent one behind it,
//! which also sees that clock stop.
//!
//! The one on the bus clock is the window watchdog, with its window open. It bites between `count` and `count + 1`
//! of its ticks after it was fed, and nothing stops it once it runs: so it starts after all that takes long at a start,
//! and what takes long later first asks for the longest time.

use embassy_stm32::pac;
use embassy_stm32::pac::wwdg::vals::Wdgtb;
use embassy_stm32::peripherals::{IWDG, WWDG};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, rcc};
use fingertip::scan::ScanTiming;

/// The independent watchdog's time by its nominal clock; 8 to 23 ms over the clock's tolerance.
const INDEPENDENT_US: u32 = 12_000;
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
    independent: IndependentWatchdog<'static, IWDG>,
    count: u8,
}

impl Watchdogs {
    /// Neither runs yet.
    pub fn new(independent: Peri<'static, IWDG>, _window: Peri<'static, WWDG>) -> Self {
        rcc::enable_and_reset::<WWDG>();
        Self { independent: IndependentWatchdog::new(independent, INDEPENDENT_US), count: LARGEST as u8 }
    }

    /// Starts both, with the longest time. The independent one takes its own some cycles of its clock after its start
    /// (RM0390, IWDG_SR): until it is fed then, 0.2 ms later, it counts from 0.5 s.
    pub fn start(&mut self) {
        self.independent.unleash();
        self.allow_long();
    }

    /// From now on a frame is to be answered in time: 1 ms, or eight frames where these take longer.
    pub fn expect_frames(&mut self, timing: ScanTiming) {
        let ticks = (FRAMES * timing.frame().0).div_ceil(TICK).max(LEAST);
        let divider = (0u8..3).find(|divider| ticks >> divider < LARGEST).unwrap_or(3);
        self.set(Wdgtb::from_bits(divider), (ticks >> divider) as u8 + u8::from(divider > 0));
    }

    /// From now on both wait for as long as they can: 8 ms at least.
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
        self.independent.pet();
        pac::WWDG.cr().write(|w| {
            w.set_t(END | self.count);
            w.set_wdga(true);
        });
    }
}
