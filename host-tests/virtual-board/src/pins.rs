//! That the image sets up each pin for what the board wires to it: the emulator joins peripherals whatever the pins
//! say.

use crate::error::Error;
use crate::rig::Rig;
use rigless::soc::stm32f427::generated::gpioa::Register;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};

/// What a pin must be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Output,
    Analog,
    Function(u8),
}

/// Port, pins, mode: the table of `docs/board.md`.
const WIRED: [(usize, &[u8], Mode); 11] = [
    (1, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], Mode::Output),
    (0, &[0, 1, 4, 6, 7], Mode::Analog),
    (2, &[0, 1, 2, 3, 4, 5], Mode::Analog),
    (0, &[8, 9], Mode::Function(1)),
    (1, &[12], Mode::Function(1)),
    (1, &[10, 13, 15], Mode::Output),
    (1, &[14], Mode::Function(3)),
    (2, &[6, 7], Mode::Function(2)),
    (0, &[2, 3], Mode::Function(7)),
    (2, &[8, 9], Mode::Output),
    (0, &[5], Mode::Output),
];

impl Rig {
    /// The pins that are not set up for what the board wires to them.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn miswired_pins(&mut self) -> Result<Vec<String>, Error> {
        self.with(|stand| {
            let chip = &mut stand.session.board_mut().part.chip;
            let mut wrong = Vec::new();
            for (port, pins, wanted) in WIRED {
                let (_, registers) = chip.port(port);
                for number in pins {
                    let pin = Pin::new(*number).expect("ports have 16 pins");
                    let is = match registers.get(Register::Moder) >> (2 * number) & 0b11 {
                        1 => Some(Mode::Output),
                        3 => Some(Mode::Analog),
                        _ => Gpio::function(pin, registers).map(Mode::Function),
                    };
                    if is != Some(wanted) {
                        let port = ['A', 'B', 'C'][port];
                        wrong.push(format!("P{port}{number} must be {wanted:?} and is {is:?}"));
                    }
                }
            }
            wrong
        })
    }
}
