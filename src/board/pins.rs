//! Pins that the hardware drives by itself: set once, kept for good.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, OutputType, Pin, Pull, Speed};
use fingertip::shipped::{COLUMNS, ROWS};

/// Pins of a scan: rows and columns.
pub type OfScan = ([Peri<'static, AnyPin>; ROWS], [Peri<'static, AnyPin>; COLUMNS]);

/// Takes the pins of the scan, rows 0 to 9 and columns 0 to 9, from the peripherals.
macro_rules! of_scan {
    ($p:ident) => {
        (
            $crate::board::pins::taken!($p PB0 PB1 PB2 PB3 PB4 PB5 PB6 PB7 PB8 PB9),
            $crate::board::pins::taken!($p PA1 PC0 PC1 PC2 PC3 PA4 PA6 PA7 PC4 PC5),
        )
    };
}
macro_rules! taken {
    ($p:ident $($pin:ident)*) => { [$($p.$pin.into()),*] };
}
pub(crate) use {of_scan, taken};

/// Rows 0 to 9, none driven. The scan moves them through the port's set/reset register, two at once: with slow edges
/// (100 ns at most, DS10693), which disturb the columns less and are a small part of the settle time.
pub fn rows(pins: [Peri<'static, AnyPin>; ROWS]) {
    for pin in pins {
        low_output(pin, Speed::Low);
    }
}

/// Inputs of the converters.
pub fn analog(pins: impl IntoIterator<Item = Peri<'static, AnyPin>>) {
    for pin in pins {
        let mut pin = Flex::new(pin);
        pin.set_as_analog();
        keep(pin);
    }
}

/// An input of a timer or a port.
pub fn input(pin: Peri<'static, impl Pin>, function: u8, pull: Pull) {
    alternate(pin.into(), function, AfType::input(pull));
}

/// A timer's output, pulled down while the timer leaves it.
pub fn timer_output(pin: Peri<'static, impl Pin>, function: u8, speed: Speed) {
    alternate(pin.into(), function, AfType::output_pull(OutputType::PushPull, speed, Pull::Down));
}

/// An output that starts low and is then set through its port.
#[inline(never)]
pub fn low_output(pin: Peri<'static, AnyPin>, speed: Speed) {
    core::mem::forget(Output::new(pin, Level::Low, speed));
}

#[inline(never)]
fn alternate(pin: Peri<'static, AnyPin>, function: u8, kind: AfType) {
    let mut pin = Flex::new(pin);
    pin.set_as_af_unchecked(function, kind);
    keep(pin);
}

/// Dropping a pin would disconnect it.
fn keep(pin: Flex<'static>) {
    core::mem::forget(pin);
}
