//! The motor's quadrature encoder on TIM3, unwrapped to 32 bits.

use embassy_stm32::gpio::Pull;
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms};
use embassy_stm32::peripherals::{PC6, PC7, TIM3};
use embassy_stm32::{Peri, pac, rcc};

use super::pins;

const TIM3_FUNCTION: u8 = 2;

/// Counts grow as the tip presses in.
pub struct Encoder {
    last: u16,
    count: i32,
}

impl Encoder {
    /// Starts counting at zero, all four edges of a quadrature period.
    pub fn new(_timer: Peri<'static, TIM3>, a: Peri<'static, PC6>, b: Peri<'static, PC7>) -> Self {
        // The pins take the 5 V of a push-pull encoder, but only without a pull (DS10693).
        pins::input(a, TIM3_FUNCTION, Pull::None);
        pins::input(b, TIM3_FUNCTION, Pull::None);
        rcc::enable_and_reset::<TIM3>();
        let timer = pac::TIM3;
        timer.ccmr_input(0).modify(|w| {
            for channel in 0..2 {
                // Each channel from its own input; 8 samples at 84 MHz reject spikes below 95 ns.
                w.set_ccs(channel, CcmrInputCcs::TI4);
                w.set_icf(channel, FilterValue::FCK_INT_N8);
            }
        });
        timer.smcr().modify(|w| w.set_sms(Sms::ENCODER_MODE_3));
        timer.arr().write(|w| w.set_arr(u16::MAX));
        timer.cr1().modify(|w| w.set_cen(true));
        Self { last: timer.cnt().read().cnt(), count: 0 }
    }

    /// The count now; wraps at 32 bits. Call it before the motor can move 32,768 counts, a tenth of a second at full
    /// speed.
    pub fn read(&mut self) -> i32 {
        let now = pac::TIM3.cnt().read().cnt();
        self.count = self.count.wrapping_add(i32::from(now.wrapping_sub(self.last) as i16));
        self.last = now;
        self.count
    }
}
