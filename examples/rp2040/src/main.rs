//! The fingertip controller on a Raspberry Pi Pico (RP2040): 6 x 4 taxels, one converter, 2 kHz, no bus and no flash.
//!
//! One file for each verb of `docs/porting.md`: [`scan`] drives the rows and converts the columns, [`bridge`] drives the
//! motor, [`guard`] cuts it where no frame is answered, [`encoder`] counts, [`clocks`] starts the chip. This file is the
//! control task. Compiled and linked in every check; it has run on no board.
//!
//! | GPIO | is |
//! | --- | --- |
//! | 2 to 7 | the rows' drivers, high where driven |
//! | 26 to 29 | the columns' amplifiers |
//! | 8, 9 | IN1 and IN2 of a bridge that brakes with both high and opens with both low (DRV8212 and others) |
//! | 10, 11 | the bridge's nSLEEP, pulled down, and nFAULT, pulled up |
//! | 12, 13 | the encoder's channels A and B |
//! | 14 | an analogue switch at GPIO 29: low is the last column, high is the supply divided by 11 |
//! | 15 | a button to ground: holds 1 N while it is pressed |
#![no_std]
#![no_main]

mod bridge;
mod clocks;
mod encoder;
mod finger;
mod guard;
mod pins;
mod scan;

use bridge::Bridge;
use finger::{CLOCKS, COLUMNS, PARAMS, ROWS};
use fingertip::command::Command;
use fingertip::config::{Shaped, newtons};
use fingertip::frame::Sense;
use fingertip::pipeline::{Pipeline, Taring};
use panic_halt as _;

/// The second stage of the boot, for the flash of a Pico.
#[used]
#[unsafe(link_section = ".boot2")]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

#[cortex_m_rt::entry]
fn main() -> ! {
    clocks::start();
    pins::set_up();
    let mut bridge = Bridge::open();
    // A test on a host shows that these numbers are accepted.
    let Ok(config) = Shaped::<ROWS, COLUMNS>::new(&PARAMS, &CLOCKS) else {
        loop {
            cortex_m::asm::wfi();
        }
    };
    let mut pipeline = Pipeline::new(&config);
    let mut command = Command { tare_request: 1, ..Command::default() };
    encoder::start();
    scan::start(&config.timing);
    guard::start(&config.timing);
    loop {
        let scanned = scan::wait();
        let sense = Sense {
            encoder: encoder::count(),
            supply_mv: scanned.supply_mv,
            bridge_fault: pins::bridge_fault(),
            ..Sense::default()
        };
        let (_, status) = pipeline.step(&scanned.frame, &sense, &command);
        bridge.set(status.bridge());
        // The guard moves its deadline: this frame was answered.
        guard::answered();
        command.torque = status.tare == Taring::Done && status.fault.is_none();
        command.goal = newtons(if command.torque && pins::button_pressed() { 1_000 } else { 0 });
    }
}
