//! The closed loop on any emulated core: reports its digest and the instructions per frame.
//!
//! Not for a board: it talks to the emulator by semihosting. A loop of known length measures the instructions in a tick
//! of the core's counter is, so the counts do not depend on the emulator's clocks.
#![no_std]
#![no_main]

use core::hint::black_box;
use images::closed_loop::{Ended, FRAMES, run};
use semihosting::{print, println, process};

#[cfg(target_arch = "arm")]
use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
use riscv_rt::entry;

/// Instructions of the loop that measures the length of a tick.
const LOOP_INSTRUCTIONS: u32 = 100_000;

/// Rows, columns, and the distance between two taxels in um. The flags of the build choose the larger arrays.
const ARRAY: (usize, usize, u32) = if cfg!(array = "16x16") {
    (16, 16, 937)
} else if cfg!(array = "10x10") {
    (10, 10, 1_500)
} else {
    (6, 4, 1_900)
};

#[entry]
fn main() -> ! {
    counter::start();
    let [loop_ticks, empty_ticks] = [counter::ticks(counter::spin), counter::ticks(|| {})];
    let loop_ticks = u64::from(loop_ticks - empty_ticks);
    let instructions = |ticks: u64| ticks * u64::from(LOOP_INSTRUCTIONS) / loop_ticks;
    let (mut total, mut max) = (0_u64, 0);
    let ended = run::<{ ARRAY.0 }, { ARRAY.1 }>(ARRAY.2, |finger, frame, sense, command| {
        let mut duty = None;
        let ticks = counter::ticks(|| duty = Some(black_box(finger.step(frame, sense, command).0))) - empty_ticks;
        total += u64::from(ticks);
        max = max.max(ticks);
        duty.unwrap_or_default()
    });
    let Ok(Ended { digest, true_mn, .. }) = ended else { panic!("the parameters are refused") };
    print!("digest {:08x}{:08x}\ntrue_mn {true_mn}\n", (digest >> 32) as u32, digest as u32);
    println!("instructions_mean {}", instructions(total) / u64::from(FRAMES));
    println!("instructions_max {}", instructions(max.into()));
    println!("dsp {}\nfpu {}", u32::from(lanes::DSP), u32::from(lanes::FPU));
    process::exit(0)
}

/// SysTick, 24 bits.
#[cfg(target_arch = "arm")]
mod counter {
    use cortex_m::peripheral::{SYST, syst::SystClkSource};
    use cortex_m_rt::{ExceptionFrame, exception};

    const TICKS_MAX: u32 = 0x00ff_ffff;

    pub fn start() {
        let Some(mut syst) = cortex_m::Peripherals::take().map(|peripherals| peripherals.SYST) else {
            panic!("the peripherals are taken")
        };
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(TICKS_MAX);
        syst.clear_current();
        syst.enable_counter();
    }

    /// Returns the ticks that some work takes.
    pub fn ticks(work: impl FnOnce()) -> u32 {
        let start = SYST::get_current();
        work();
        start.wrapping_sub(SYST::get_current()) & TICKS_MAX
    }

    /// Takes [`super::LOOP_INSTRUCTIONS`], two a turn.
    pub fn spin() {
        // SAFETY: counts a register of its own down to 0, and touches nothing else.
        unsafe {
            core::arch::asm!(
                "2: subs {turns}, {turns}, #1",
                "bne 2b",
                turns = inout(reg) super::LOOP_INSTRUCTIONS / 2 => _,
                options(nomem, nostack),
            );
        }
    }

    #[exception]
    unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
        panic!("hard fault at {:#010x}", frame.pc())
    }
}

/// The counter of executed instructions.
#[cfg(target_arch = "riscv32")]
mod counter {
    use core::arch::asm;

    pub fn start() {}

    fn now() -> u32 {
        let count;
        // SAFETY: reads a counter.
        unsafe { asm!("csrr {}, minstret", out(reg) count, options(nomem, nostack)) };
        count
    }

    /// Returns the ticks that some work takes.
    pub fn ticks(work: impl FnOnce()) -> u32 {
        let start = now();
        work();
        now().wrapping_sub(start)
    }

    /// Takes [`super::LOOP_INSTRUCTIONS`], two a turn.
    pub fn spin() {
        // SAFETY: counts a register of its own down to 0, and touches nothing else.
        unsafe {
            asm!(
                "2: addi {turns}, {turns}, -1",
                "bnez {turns}, 2b",
                turns = inout(reg) super::LOOP_INSTRUCTIONS / 2 => _,
                options(nomem, nostack),
            );
        }
    }

    /// Ends the run where `riscv-rt` would wait for ever.
    #[unsafe(export_name = "ExceptionHandler")]
    fn exception(_: &riscv_rt::TrapFrame) -> ! {
        panic!("an exception")
    }
}
