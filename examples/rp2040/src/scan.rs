//! The scan: an alarm starts each frame; a slice of the PWM counts its slots. In each slot a row is driven, and after the
//! settle time the converter reads the four columns in turn into its FIFO. Behind the last slot it reads the supply.

use crate::{COLUMNS, ROWS, pins};
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use fingertip::frame::Frame;
use fingertip::scan::ScanTiming;
use rp_pac::{ADC, Interrupt, PWM, TIMER, interrupt};

/// The slice that counts slots.
const SLICE: usize = 7;
/// The alarm of the timer that starts frames.
const ALARM: usize = 0;
/// A code of the supply, behind a divider by 11, in uV at 3.3 V of reference.
const SUPPLY_UV_PER_CODE: u32 = 8_862;

/// A whole frame, and the supply behind it.
#[derive(Clone, Copy)]
pub struct Scanned {
    /// The codes.
    pub frame: Frame<ROWS, COLUMNS>,
    /// The supply, mV; 0 where the converter gave no code.
    pub supply_mv: u16,
}

struct Scan {
    scanned: Scanned,
    /// The slot that is being scanned: a row, none, or the supply's.
    slot: usize,
    /// Whole frame that was not taken yet.
    whole: Option<Scanned>,
    next_us: u32,
    frame_us: u32,
    settle_cycles: u32,
}

static SCAN: Mutex<RefCell<Option<Scan>>> = Mutex::new(RefCell::new(None));

/// Scans from now on.
pub fn start(timing: &ScanTiming) {
    ADC.cs().write(|control| control.set_en(true));
    while !ADC.cs().read().ready() {}
    ADC.fcs().write(|fifo| fifo.set_en(true));
    let slice = PWM.ch(SLICE);
    slice.top().write(|top| top.set_top((timing.slot.0 - 1) as u16));
    PWM.inte().modify(|enabled| enabled.set_ch7(true));
    TIMER.inte().modify(|enabled| enabled.set_alarm(ALARM, true));
    let mut scan = Scan {
        scanned: Scanned { frame: Frame::EMPTY, supply_mv: 0 },
        slot: 0,
        whole: None,
        next_us: TIMER.timerawl().read(),
        frame_us: timing.frame_ns / 1_000,
        settle_cycles: timing.settle.0,
    };
    scan.await_frame();
    free(|section| *SCAN.borrow(section).borrow_mut() = Some(scan));
    // SAFETY: the handlers below share the scan through a critical section only.
    unsafe {
        NVIC::unmask(Interrupt::TIMER_IRQ_0);
        NVIC::unmask(Interrupt::PWM_IRQ_WRAP);
    }
}

/// Waits for the next whole frame. One that was not taken before the next is lost, and missing in its numbers.
pub fn wait() -> Scanned {
    loop {
        let taken = free(|section| SCAN.borrow(section).borrow_mut().as_mut().and_then(|scan| scan.whole.take()));
        match taken {
            Some(scanned) => return scanned,
            None => cortex_m::asm::wfi(),
        }
    }
}

impl Scan {
    fn await_frame(&mut self) {
        self.next_us = self.next_us.wrapping_add(self.frame_us);
        TIMER.alarm(ALARM).write_value(self.next_us);
    }

    fn begin(&mut self) {
        self.await_frame();
        self.slot = 0;
        PWM.ch(SLICE).ctr().write(|counter| counter.set_ctr(0));
        PWM.ch(SLICE).csr().write(|control| control.set_en(true));
        self.convert();
    }

    /// Drives this slot's row and starts its conversions behind the settle time.
    fn convert(&mut self) {
        match self.slot {
            row if row < ROWS => pins::high(pins::ROWS + row),
            ROWS => {}
            _ => pins::high(pins::SUPPLY),
        }
        cortex_m::asm::delay(self.settle_cycles);
        // The FIFO holds four codes: those of the columns. The converter goes on in vain until the slot's end.
        ADC.cs().write(|control| {
            control.set_en(true);
            control.set_rrobin(0b1111);
            control.set_start_many(true);
        });
    }

    /// Takes this slot's codes, and goes to the next one.
    fn end_slot(&mut self) {
        ADC.cs().write(|control| control.set_en(true));
        while !ADC.cs().read().ready() {}
        let mut codes = [0; COLUMNS];
        for code in &mut codes {
            // A code that is not there stays 0, which the core takes for a broken column.
            if !ADC.fcs().read().empty() {
                *code = ADC.fifo().read().val();
            }
        }
        while !ADC.fcs().read().empty() {
            ADC.fifo().read();
        }
        if self.slot <= ROWS {
            codes.iter().enumerate().for_each(|(column, code)| self.scanned.frame.set_code(self.slot, column, *code));
        } else {
            let supply = u32::from(codes[COLUMNS - 1]) * SUPPLY_UV_PER_CODE / 1_000;
            self.scanned.supply_mv = supply.min(u16::MAX.into()) as u16;
        }
        if self.slot < ROWS {
            pins::low(pins::ROWS + self.slot);
        }
        self.slot += 1;
        if self.slot <= ROWS + 1 {
            self.convert();
            return;
        }
        PWM.ch(SLICE).csr().write(|control| control.set_en(false));
        pins::low(pins::SUPPLY);
        self.scanned.frame.sequence = self.scanned.frame.sequence.wrapping_add(1);
        self.whole = Some(self.scanned);
    }
}

fn with(act: impl FnOnce(&mut Scan)) {
    free(|section| {
        if let Some(scan) = SCAN.borrow(section).borrow_mut().as_mut() {
            act(scan);
        }
    });
}

#[interrupt]
fn TIMER_IRQ_0() {
    TIMER.intr().write(|pending| pending.set_alarm(ALARM, true));
    with(Scan::begin);
}

#[interrupt]
fn PWM_IRQ_WRAP() {
    PWM.intr().write(|pending| pending.set_ch7(true));
    with(Scan::end_slot);
}
