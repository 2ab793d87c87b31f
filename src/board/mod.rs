//! The one place with pins, DMA, triggers, vectors and unsafe code; `docs/board.md` is its contract.

use embassy_stm32::interrupt::{self, InterruptExt, Priority};

pub mod analogue;
pub mod bridge;
pub mod bus;
pub mod capture;
pub mod clocks;
pub mod control;
mod copy;
pub mod crash;
pub mod exchange;
pub mod flash;
pub mod guard;
pub mod health;
pub mod link_task;
pub mod log;
pub mod pins;
pub mod scan;
pub mod stack;
pub mod trace;

/// Sets every priority of the table in `docs/firmware.md`; embassy leaves most of them at the highest.
///
/// Comes after [`clocks::init`], which sets those of the time driver and of all DMA streams itself.
pub fn set_priorities() {
    for (interrupt, priority) in [
        (interrupt::TIM5, Priority::P0),
        (interrupt::DMA2_STREAM2, Priority::P1),
        (interrupt::USART2, Priority::P1),
        (interrupt::SPI3, Priority::P2),
        // Half of the rows: control's turn is not interrupted for it.
        (interrupt::DMA2_STREAM1, Priority::P2),
        (interrupt::TIM2, Priority::P5),
        (interrupt::DMA1_STREAM5, Priority::P6),
        (interrupt::DMA1_STREAM6, Priority::P6),
    ] {
        interrupt.set_priority(priority);
    }
}
