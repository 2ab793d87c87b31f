//! Failure of the firmware: the bridge is cut, a record is left for after the reset, the reset follows.
//!
//! The record lies in memory that start-up does not clear; a magic word and a check word distinguish it from noise.

use core::arch::naked_asm;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use embassy_stm32::pac;
use embassy_stm32::pac::rcc::regs::Csr;
use fingertip::link::snapshot::{Crash, CrashCause, ResetCause};

use super::bridge;
use super::stack::{_stack_end, _stack_start};

const MAGIC: u32 = 0x4649_4E47;

#[derive(Clone, Copy)]
#[repr(C)]
struct Record {
    magic: u32,
    cause: u32,
    line: u32,
    pc: u32,
    count: u32,
    /// 1 from the crash to the next start.
    fresh: u32,
    check: u32,
}

#[unsafe(link_section = ".uninit.crash")]
static mut RECORD: MaybeUninit<Record> = MaybeUninit::uninit();

/// Reason of this start.
#[derive(Clone, Copy)]
pub struct Boot {
    /// Cause of the reset.
    pub reset: ResetCause,
    /// The last crash since power-on.
    pub crash: Crash,
    /// True if that crash ended the last run.
    pub crashed: bool,
}

/// Reads and clears the reset flags and settles the record. Call it once, first thing after reset.
pub fn boot() -> Boot {
    let csr = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    let reset = reset_cause(csr);
    let stored = if reset == ResetCause::PowerOn { None } else { Record::load() };
    let mut record = stored.unwrap_or(Record::NONE);
    let mut crashed = record.fresh != 0;
    if reset == ResetCause::Watchdog && !crashed {
        record =
            Record { cause: CrashCause::Hang as u32, line: 0, pc: 0, count: record.count.wrapping_add(1), ..record };
        crashed = true;
    }
    Record { fresh: 0, ..record }.store();
    Boot { reset, crash: record.crash(), crashed }
}

fn reset_cause(csr: Csr) -> ResetCause {
    [
        (csr.wdgrstf() || csr.wwdgrstf(), ResetCause::Watchdog),
        (csr.lpwrrstf(), ResetCause::Other),
        (csr.sftrstf(), ResetCause::Software),
        (csr.porrstf(), ResetCause::PowerOn),
        (csr.borrstf(), ResetCause::BrownOut),
        (csr.padrstf(), ResetCause::Pin),
    ]
    .into_iter()
    .find_map(|(flag, cause)| flag.then_some(cause))
    .unwrap_or(ResetCause::Unknown)
}

impl Record {
    const NONE: Self =
        Self { magic: MAGIC, cause: CrashCause::None as u32, line: 0, pc: 0, count: 0, fresh: 0, check: 0 };

    fn load() -> Option<Self> {
        // SAFETY: any bit pattern is a valid `Record`, and nothing else runs: this is called at the start and from
        // handlers that do not return.
        let record = unsafe { (&raw const RECORD).cast::<Self>().read_volatile() };
        (record.magic == MAGIC && record.check == record.checked()).then_some(record)
    }

    fn store(mut self) {
        self.check = self.checked();
        // SAFETY: as for `load`.
        unsafe { (&raw mut RECORD).cast::<Self>().write_volatile(self) };
    }

    /// Differs for any one word changed, and for memory that is all zeros or all ones.
    fn checked(&self) -> u32 {
        [self.magic, self.cause, self.line, self.pc, self.count, self.fresh]
            .into_iter()
            .fold(0x5EED_5EED, |sum: u32, word| sum.rotate_left(5) ^ word)
    }

    fn crash(&self) -> Crash {
        let cause = [CrashCause::Panic, CrashCause::HardFault, CrashCause::Hang, CrashCause::Clock]
            .into_iter()
            .find(|cause| *cause as u32 == self.cause)
            .unwrap_or(CrashCause::None);
        Crash { cause, line: self.line.min(u32::from(u16::MAX)) as u16, count: self.count, pc: self.pc }
    }
}

fn end(cause: CrashCause, line: u32, pc: u32) -> ! {
    let count = Record::load().map_or(0, |record| record.count).wrapping_add(1);
    Record { cause: cause as u32, line, pc, count, fresh: 1, ..Record::NONE }.store();
    SCB::sys_reset()
}

/// Resets on request, with the bridge cut and no crash recorded.
pub fn reboot() -> ! {
    cortex_m::interrupt::disable();
    bridge::make_safe();
    SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    // Interrupts first: control could drive the bridge again before the reset.
    cortex_m::interrupt::disable();
    bridge::make_safe();
    end(CrashCause::Panic, info.location().map_or(0, core::panic::Location::line), 0)
}

/// Any vector without a handler.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_number: i16) {
    panic!();
}

/// The external clock failed: nothing else raises this exception. The core runs on from the internal oscillator at
/// 16 MHz, and the failure has broken TIM1 already.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() -> ! {
    bridge::make_safe();
    end(CrashCause::Clock, 0, 0)
}

/// Switches to a separate stack if the fault was a stack overflow, and passes on the exception's frame.
///
/// # Safety
/// Only the vector table may refer to it.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:_stack_end",
        "movt r1, #:upper16:_stack_end",
        "add r1, r1, #256",
        "cmp r0, r1",
        "bhs 2f",
        "movw r1, #:lower16:_stack_start",
        "movt r1, #:upper16:_stack_start",
        "mov sp, r1",
        "2: b {handler}",
        handler = sym hard_fault,
    )
}

extern "C" fn hard_fault(frame: *const u32) -> ! {
    bridge::make_safe();
    /// Index of the program counter in the exception's frame, words.
    const PC_PLACE: usize = 6;
    let stack = (&raw const _stack_end)..(&raw const _stack_start);
    let place = frame.wrapping_add(PC_PLACE);
    let pc = if frame.is_aligned() && stack.contains(&frame) && stack.contains(&place) {
        // SAFETY: aligned and inside the stack, which is always readable.
        unsafe { place.read_volatile() }
    } else {
        0
    };
    end(CrashCause::HardFault, 0, pc)
}
