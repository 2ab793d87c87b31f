//! The guard: shorts the motor after 1.75 frames without an answer, and resets a processor that hangs.

use crate::bridge;
use core::cell::Cell;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use fingertip::scan::ScanTiming;
use rp_pac::{Interrupt, TIMER, WATCHDOG, interrupt};

/// The alarm of the timer that the guard takes.
const ALARM: usize = 1;
/// The watchdog counts 24 bits twice in a microsecond (RP2040-E1): 2 ms.
const WATCHDOG_TICKS: u32 = 4_000;

/// One and three quarters of a frame, us.
static SPAN_US: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// Guards from now on.
pub fn start(timing: &ScanTiming) {
    free(|section| SPAN_US.borrow(section).set(timing.frame_ns / 1_000 * 7 / 4));
    TIMER.inte().modify(|enabled| enabled.set_alarm(ALARM, true));
    answered();
    WATCHDOG.load().write(|load| load.set_load(WATCHDOG_TICKS));
    WATCHDOG.ctrl().modify(|control| control.set_enable(true));
    // SAFETY: the handler below writes registers that no critical section protects, each in one write.
    unsafe { NVIC::unmask(Interrupt::TIMER_IRQ_1) };
}

/// A frame was answered: the next one has its time.
pub fn answered() {
    let span_us = free(|section| SPAN_US.borrow(section).get());
    TIMER.alarm(ALARM).write_value(TIMER.timerawl().read().wrapping_add(span_us));
    WATCHDOG.load().write(|load| load.set_load(WATCHDOG_TICKS));
}

#[interrupt]
fn TIMER_IRQ_1() {
    bridge::cut();
    TIMER.intr().write(|pending| pending.set_alarm(ALARM, true));
    // Until the next answer. Where none comes, the watchdog resets, and the driver's pull-down opens the bridge.
    TIMER.alarm(ALARM).write_value(TIMER.timerawl().read().wrapping_add(100));
}
