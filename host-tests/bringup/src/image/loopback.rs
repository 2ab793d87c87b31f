//! The bus's port hears itself, at each speed of the bus: in single-wire mode its receiver is on the transmit pin.

use cortex_m::peripheral::DWT;
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Pupdr;

use crate::{CYCLES_PER_US, passed, report};
use bringup::text::BAUD;

const BYTES: u32 = 256;
const TX_PIN: usize = 2;
/// The bus's speeds, but that of 9600 baud.
const SPEEDS: [u32; 5] = [57_600, 115_200, 1_000_000, 2_000_000, 3_000_000];

/// Reports for each speed the number of bytes that came back wrong.
pub fn run() {
    report::flush();
    pac::GPIOA.pupdr().modify(|w| w.set_pupdr(TX_PIN, Pupdr::PULL_UP));
    let wrong = SPEEDS.map(|baud| (baud, at(baud)));
    pac::GPIOA.pupdr().modify(|w| w.set_pupdr(TX_PIN, Pupdr::FLOATING));
    single_wire(false);
    report::set_baud(BAUD);
    // What the host made of the bytes above ends here.
    report::say(format_args!(""));
    for (baud, wrong) in wrong {
        report::figure(format_args!("loopback_{baud}"), wrong as f32);
    }
}

fn single_wire(on: bool) {
    pac::USART2.cr1().modify(|w| w.set_ue(false));
    pac::USART2.cr3().modify(|w| w.set_hdsel(on));
    pac::USART2.cr1().modify(|w| w.set_ue(true));
}

/// Returns the number of wrong bytes.
fn at(baud: u32) -> u32 {
    report::set_baud(baud);
    single_wire(true);
    while report::received().is_some() {}
    let mut wrong = 0;
    for byte in 0..BYTES {
        // All of them, in an order in which neighbours differ in many bits.
        let byte = (byte * 151) as u8;
        report::send(byte);
        let since = DWT::cycle_count();
        let came = loop {
            if let Some(came) = report::received() {
                break Some(came);
            }
            if passed(since, 1_000 * CYCLES_PER_US) {
                break None;
            }
        };
        wrong += u32::from(came != Some(byte));
        if came.is_none() {
            return BYTES;
        }
    }
    wrong
}
