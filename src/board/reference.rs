//! The analogue supply, measured by the internal reference with the first converter, before the scan takes that.

use embassy_stm32::pac;

use super::{converter, health};

/// The reference's input.
const CHANNEL: u8 = 17;
/// What the factory read of the reference at 3.3 V.
const CALIBRATION: *const u16 = 0x1FFF_7A2A as *const u16;
const CALIBRATED_AT_MV: u32 = 3_300;
/// A conversion takes 23 us.
const LOOKS: u32 = 10_000;

/// Measures once. The converter is clocked, and stands afterwards.
pub fn measure() {
    pac::ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(true));
    converter::set_sequence(pac::ADC1, [CHANNEL], converter::sample_time(480));
    pac::ADC1.cr2().write(|w| w.set_adon(true));
    // The reference wants 10 us (DS10693), the converter 3 us.
    cortex_m::asm::delay(10 * 168);
    pac::ADC1.cr2().modify(|w| w.set_swstart(true));
    let done = (0..LOOKS).any(|_| pac::ADC1.sr().read().eoc());
    let code = u32::from(pac::ADC1.dr().read().data());
    pac::ADC1.cr2().write(|_| ());
    pac::ADC1.sr().write(|_| ());
    pac::ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(false));
    // SAFETY: aligned, in the microcontroller's system memory, and always readable.
    let calibrated = u32::from(unsafe { CALIBRATION.read_volatile() });
    let millivolts = (calibrated * CALIBRATED_AT_MV).checked_div(code).filter(|_| done).unwrap_or(0);
    health::set_analogue_mv(u16::try_from(millivolts).unwrap_or(u16::MAX));
}
