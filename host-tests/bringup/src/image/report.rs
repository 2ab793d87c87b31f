//! Lines on the virtual COM port, USART2 at 115,200 baud, which any terminal shows.

use core::fmt::{Arguments, Display, Write};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Pull;
use embassy_stm32::pac::usart::vals::Over8;
use embassy_stm32::peripherals::{PA2, PA3, USART2};
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::{Peri, pac, uid};

use crate::{CYCLES_PER_US, host, passed};
use bringup::BAUD;

const APB1_HZ: u32 = 42_000_000;

static CHECK: AtomicU32 = AtomicU32::new(bringup::CHECK);

pub fn start(port: Peri<'static, USART2>, tx: Peri<'static, PA2>, rx: Peri<'static, PA3>) {
    let mut config = usart::Config::default();
    config.baudrate = BAUD;
    config.rx_pull = Pull::Up;
    match Uart::new_blocking(port, rx, tx, config) {
        // From here on by its registers.
        Ok(uart) => core::mem::forget(uart),
        Err(_) => host::fail("no such speed"),
    }
}

/// The baud rate from now on; 8 samples make a bit where 16 are too slow.
pub fn set_baud(baud: u32) {
    let (samples, halves) = if baud > 2_000_000 { (Over8::OVERSAMPLING8, 2) } else { (Over8::OVERSAMPLING16, 1) };
    let ticks = (APB1_HZ * halves + baud / 2) / baud;
    let register = if halves == 2 { (ticks & !0xf) | ((ticks & 0xf) >> 1) } else { ticks };
    pac::USART2.cr1().modify(|w| w.set_ue(false));
    pac::USART2.cr1().modify(|w| w.set_over8(samples));
    pac::USART2.brr().write(|w| w.0 = register);
    pac::USART2.cr1().modify(|w| w.set_ue(true));
}

/// Prints a progress line, which is not part of the report.
pub fn say(words: Arguments) {
    let _ = writeln!(Port, "# {words}");
}

fn line(words: Arguments) {
    let _ = writeln!(Checked, "{words}");
}

pub fn begin() {
    CHECK.store(bringup::CHECK, Ordering::Relaxed);
    line(format_args!("bringup {} {}", bringup::VERSION, uid::uid_hex()));
}

pub fn figure(name: impl Display, value: f32) {
    line(format_args!("figure {name} {value:.4}"));
}

/// Reports a whole number with all digits.
pub fn number(name: &str, value: u32) {
    line(format_args!("figure {name} {value}"));
}

/// Reports median and maximum of a kernel's cycles.
pub fn cycles(kernel: &str, median: u32, most: u32) {
    line(format_args!("cycles {median} {most} {kernel}"));
}

pub fn end() {
    let check = CHECK.load(Ordering::Relaxed);
    let _ = writeln!(Port, "end {check:08x}");
}

/// Waits for `go`, or `go FRAMES`; reports each half second that it waits.
pub fn wait_for_go() -> u32 {
    let mut word = heapless::String::<32>::new();
    let mut said = None;
    loop {
        let now = DWT::cycle_count();
        if said.is_none_or(|at| passed(at, 500_000 * CYCLES_PER_US)) {
            said = Some(now);
            say(format_args!("{}", bringup::READY));
        }
        let Some(byte) = received() else { continue };
        if byte != b'\n' && byte != b'\r' {
            // The host sends no longer line.
            let _ = word.push(char::from(byte));
            continue;
        }
        if let Some(frames) = bringup::asked_frames(&word) {
            return frames;
        }
        word.clear();
    }
}

pub fn received() -> Option<u8> {
    let status = pac::USART2.sr().read();
    // Reading the data clears the errors, too.
    let any = status.rxne() || status.ore() || status.fe() || status.ne();
    let byte = any.then(|| pac::USART2.dr().read().dr() as u8);
    byte.filter(|_| status.rxne())
}

/// Sends a byte, as soon as there is room.
pub fn send(byte: u8) {
    while !pac::USART2.sr().read().txe() {}
    pac::USART2.dr().write(|w| w.set_dr(byte.into()));
}

pub fn flush() {
    while !pac::USART2.sr().read().tc() {}
}

struct Port;

impl Write for Port {
    fn write_str(&mut self, words: &str) -> core::fmt::Result {
        words.bytes().for_each(send);
        Ok(())
    }
}

/// The port, with the running check.
struct Checked;

impl Write for Checked {
    fn write_str(&mut self, words: &str) -> core::fmt::Result {
        let check = words.bytes().fold(CHECK.load(Ordering::Relaxed), bringup::checked);
        CHECK.store(check, Ordering::Relaxed);
        Port.write_str(words)
    }
}
