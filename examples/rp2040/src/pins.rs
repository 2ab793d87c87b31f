//! Pins.

use rp_pac::{IO_BANK0, PADS_BANK0, SIO};

/// The first row's pin; the others follow.
pub const ROWS: usize = 2;
/// The bridge's inputs, which belong to the same slice of the PWM.
pub const BRIDGE: [usize; 2] = [8, 9];
/// The bridge sleeps while this is low.
pub const AWAKE: usize = 10;
const FAULT: usize = 11;
/// The encoder's channels.
pub const ENCODER: [usize; 2] = [12, 13];
/// The last converter channel reads the supply while this is high.
pub const SUPPLY: usize = 14;
const BUTTON: usize = 15;
/// The converter's channels.
const COLUMNS: [usize; 4] = [26, 27, 28, 29];

/// Functions of a pin.
const PWM: u8 = 4;
const PLAIN: u8 = 5;
const NONE: u8 = 31;

/// Sets all pins as they are at rest: rows low, bridge asleep.
pub fn set_up() {
    let outputs = (ROWS..ROWS + crate::ROWS).chain([AWAKE, SUPPLY]);
    for pin in outputs {
        low(pin);
        SIO.gpio_oe(0).value_set().write_value(1 << pin);
        function(pin, PLAIN);
    }
    for pin in ENCODER.into_iter().chain([FAULT, BUTTON]) {
        PADS_BANK0.gpio(pin).modify(|pad| {
            pad.set_pue(true);
            pad.set_pde(false);
        });
        function(pin, PLAIN);
    }
    BRIDGE.iter().for_each(|pin| function(*pin, PWM));
    for pin in COLUMNS {
        PADS_BANK0.gpio(pin).modify(|pad| {
            pad.set_ie(false);
            pad.set_od(true);
            pad.set_pue(false);
            pad.set_pde(false);
        });
        function(pin, NONE);
    }
}

/// Sets an output high.
pub fn high(pin: usize) {
    SIO.gpio_out(0).value_set().write_value(1 << pin);
}

/// Sets an output low.
pub fn low(pin: usize) {
    SIO.gpio_out(0).value_clr().write_value(1 << pin);
}

/// True if an input is high.
pub fn is_high(pin: usize) -> bool {
    SIO.gpio_in(0).read() & 1 << pin != 0
}

/// The bridge reports a fault.
pub fn bridge_fault() -> bool {
    !is_high(FAULT)
}

/// The button is pressed.
pub fn button_pressed() -> bool {
    !is_high(BUTTON)
}

fn function(pin: usize, function: u8) {
    IO_BANK0.gpio(pin).ctrl().write(|control| control.set_funcsel(function));
}
