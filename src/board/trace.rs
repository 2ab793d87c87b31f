//! Pins that show the timing of the firmware on an oscilloscope; see "Trace pins" in `docs/board.md`.
//!
//! The frame's and the trigger's are moved by the scan's own DMA and timer, at no cost. The two here cost a store each.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Speed;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{PB10, PB13, PB14, PB15};

use super::pins;

/// Set by the scan while no row is driven, once a frame.
pub const FRAME: u32 = 13;
const TIM8_FUNCTION: u8 = 3;

/// A pin that the processor moves.
#[derive(Clone, Copy)]
pub enum Pin {
    /// High from a trip of the frame guard until control has seen to it.
    Guard = 10,
    /// High through a turn of control.
    Control = 15,
}

impl Pin {
    /// Sets the pin high.
    #[inline(always)]
    pub fn high(self) {
        pac::GPIOB.bsrr().write(|w| w.0 = 1 << self as u32);
    }

    /// Sets the pin low.
    #[inline(always)]
    pub fn low(self) {
        pac::GPIOB.bsrr().write(|w| w.0 = 1 << (16 + self as u32));
    }
}

/// Takes the pins: all low, with slow edges.
pub fn start(
    guard: Peri<'static, PB10>,
    frame: Peri<'static, PB13>,
    trigger: Peri<'static, PB14>,
    control: Peri<'static, PB15>,
) {
    for pin in [guard.into(), frame.into(), control.into()] {
        pins::low_output(pin, Speed::Low);
    }
    pins::timer_output(trigger, TIM8_FUNCTION, Speed::Low);
}
