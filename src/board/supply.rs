//! The bridge's supply, from the third converter: started by software once a frame, read in the next.

use embassy_stm32::pac::adc::vals::Eocs;
use embassy_stm32::peripherals::{ADC3, PA0};
use embassy_stm32::{Peri, pac, rcc};

use super::{converter, pins};

/// Full scale: 3.3 V behind the divider by 11.
const FULL_SCALE_MV: u32 = 3_300 * 11;
const CHANNEL: u8 = 0;

/// The supply's converter.
pub struct Supply(());

impl Supply {
    /// Powers the converter up and starts its first conversion.
    pub fn new(_adc: Peri<'static, ADC3>, pin: Peri<'static, PA0>) -> Self {
        pins::analog([pin.into()]);
        rcc::enable_and_reset::<ADC3>();
        converter::set_clock();
        converter::set_sequence(pac::ADC3, [CHANNEL], converter::sample_time(84));
        pac::ADC3.cr2().write(|w| {
            w.set_adon(true);
            w.set_eocs(Eocs::EACH_CONVERSION);
        });
        converter::stabilise();
        start();
        Self(())
    }

    /// The last conversion in mV, and starts the next. A converter that does not answer reads as no supply, which stops
    /// the motor.
    pub fn read_mv(&mut self) -> u16 {
        let done = pac::ADC3.sr().read().eoc();
        let code = u32::from(pac::ADC3.dr().read().data());
        start();
        if done { ((code * FULL_SCALE_MV) >> 12) as u16 } else { 0 }
    }
}

fn start() {
    pac::ADC3.cr2().modify(|w| w.set_swstart(true));
}
