//! The core on an emulated Cortex-M4F: replays a recording, then gives random inputs to every function with instructions
//! of its own, and reports digests of the results.
//!
//! Not for a board: it talks to the emulator by semihosting. Its command line `FILE [panic|hardfault|hang]` names the
//! recording, and a failure to cause in the middle. Each failure prints a line that begins with `FAILED:` and ends the
//! emulator with an error.
//!
//! SysTick is the watchdog: it restarts before each step, and if it ever runs out, the step hangs.
#![no_std]
#![no_main]

/// The flash image's copies, which are compared too.
#[path = "../../../../src/board/copy.rs"]
mod copy;
mod host;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_rt::{ExceptionFrame, exception};
use cortex_m_semihosting::debug;
use fingertip::shipped::{Config, Pipeline};
use host::{File, command_line, fail, say};
use images::record::{Digest, MAGIC, Record};
use images::same_bits::{Comparison, INPUTS};
use static_cell::StaticCell;

/// Static, because it is as large as half of the stack.
static PIPELINE: StaticCell<Pipeline> = StaticCell::new();
static CORRECTED: StaticCell<Pipeline> = StaticCell::new();

/// SysTick counts down from here, 24 bits.
const TICKS_MAX: u32 = 0x00ff_ffff;
/// Inputs that the functions take between two restarts of SysTick.
const INPUTS_A_WATCH: u32 = 16;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Some(mut syst) = cortex_m::Peripherals::take().map(|peripherals| peripherals.SYST) else {
        fail("the peripherals are taken")
    };
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(TICKS_MAX);
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();

    let mut line = [0; 256];
    let (name, rest) = words(command_line(&mut line));
    replay(name, rest, &mut syst);
    compare(&mut syst);
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

/// Gives random inputs to every function.
fn compare(syst: &mut SYST) {
    let mut comparison = Comparison::default();
    for index in 0..INPUTS {
        if index % INPUTS_A_WATCH == 0 {
            syst.clear_current();
        }
        comparison.take();
    }
    for (name, digest) in comparison.digests() {
        say(format_args!("{name} {digest:016x}"));
    }
}

/// Replays a recording.
fn replay(name: &[u8], failure: &[u8], syst: &mut SYST) {
    let recording = File::open(name);
    let mut count = [0; 4];
    let mut magic = [0; MAGIC.len()];
    recording.read(&mut magic);
    if magic != MAGIC {
        fail("no recording of this version")
    }
    recording.read(&mut count);
    let count = u32::from_le_bytes(count);

    let Ok(config) = Config::shipped(&images::CONFIRMED) else { fail("the default parameters are refused") };
    let pipeline = PIPELINE.init_with(|| Pipeline::new(&config));
    let corrected = corrected();
    let mut digest = Digest::new();
    for index in 0..count {
        let mut bytes = [0; Record::BYTES];
        recording.read(&mut bytes);
        let Record { frame, sense, command } = Record::from_bytes(&bytes);
        if index == count / 2 {
            inject(failure);
        }
        syst.clear_current();
        let (duty, status) = pipeline.step(&frame, &sense, &command);
        digest.add(duty, status);
        let command = images::varied(index, &command);
        let (duty, status) = corrected.step(&frame, &sense, &command);
        digest.add(duty, status);
    }
    say(format_args!("digest {:016x}", digest.value()));
    say(format_args!("steps {count}"));
}

/// A controller with all corrections. A separate function, because its configuration takes stack only here.
#[inline(never)]
fn corrected() -> &'static mut Pipeline {
    let Ok(config) = Config::shipped(&images::CORRECTED) else { fail("a curve is refused") };
    CORRECTED.init_with(|| Pipeline::new(&config))
}

fn inject(failure: &[u8]) {
    match failure {
        b"panic" => panic!("injected"),
        b"hardfault" => cortex_m::asm::udf(),
        b"hang" => loop {
            cortex_m::asm::nop();
        },
        b"" => {}
        _ => fail("no such failure to inject"),
    }
}

/// Splits the command line behind its first word, which then ends with a 0.
fn words(line: &mut [u8]) -> (&[u8], &[u8]) {
    let length = line.len() - 1;
    let split = line.iter().position(|byte| *byte == b' ').unwrap_or(length);
    line[split] = 0;
    let (name, rest) = line.split_at(split + 1);
    (name, rest.get(..length.saturating_sub(split + 1)).unwrap_or_default())
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    fail(format_args!("panic: {}", info.message()))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    fail(format_args!("hard fault at {:#010x}", frame.pc()))
}

#[exception]
fn SysTick() {
    fail(format_args!("hang: a step took more than {TICKS_MAX} ticks"))
}
