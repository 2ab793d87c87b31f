//! What the three converters share: clock, power and sampling time.

use embassy_stm32::pac;
use embassy_stm32::pac::adc::Adc;
use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::adccommon::vals::Adcpre;

/// 84 MHz / 4 = 21 MHz for all converters, each on its own.
pub fn set_clock() {
    pac::ADC123_COMMON.ccr().modify(|w| w.set_adcpre(Adcpre::DIV4));
}

/// A converter wants 3 us from power-up to its first conversion (DS10693, t_STAB).
pub fn stabilise() {
    cortex_m::asm::delay(3 * 168);
}

/// The register's code for a sampling time that `ScanTiming` let through; the longest for any other.
pub const fn sample_time(cycles: u16) -> SampleTime {
    match cycles {
        3 => SampleTime::CYCLES3,
        15 => SampleTime::CYCLES15,
        28 => SampleTime::CYCLES28,
        56 => SampleTime::CYCLES56,
        84 => SampleTime::CYCLES84,
        112 => SampleTime::CYCLES112,
        144 => SampleTime::CYCLES144,
        _ => SampleTime::CYCLES480,
    }
}

/// The channels of a regular sequence, in order, and one sampling time for all.
pub fn set_sequence<const N: usize>(adc: Adc, channels: [u8; N], time: SampleTime) {
    const { assert!(N <= 6, "SQR3 holds six ranks") };
    adc.sqr1().write(|w| w.set_l(N as u8 - 1));
    adc.sqr3().write(|w| {
        for (rank, channel) in channels.into_iter().enumerate() {
            w.set_sq(rank, channel);
        }
    });
    adc.smpr2().write(|w| (0..10).for_each(|channel| w.set_smp(channel, time)));
    adc.smpr1().write(|w| (0..9).for_each(|channel| w.set_smp(channel, time)));
}
