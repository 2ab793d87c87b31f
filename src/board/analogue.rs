//! ADC1, which the scan leaves alone: the bridge's supply, and behind each conversion of it, as the
//! injected group, the internal reference and the microcontroller's temperature.
//!
//! Software starts it in the middle of a frame and takes its codes in the middle of the next. All three take 51 us, the
//! supply the first 5; where a frame is shorter than that, it is started in every other.
//!
//! Clock, power and sampling time are set alike for all three converters.

use embassy_stm32::pac::adc::Adc;
use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::peripherals::{ADC1, PA0};
use embassy_stm32::{Peri, pac, rcc};
use fingertip::chip::{Chip, Factory};
use fingertip::units::Celsius;

use super::{health, pins};

/// Full scale: 3.3 V behind the divider by 11.
const FULL_SCALE_MV: u32 = 3_300 * 11;
const SUPPLY: u8 = 0;
const REFERENCE: u8 = 17;
const SENSOR: u8 = 18;
/// The factory's codes of the reference, and of the sensor at 30 and 110 degrees Celsius (DS10693).
const FACTORY: [*const u16; 3] = [0x1FFF_7A2A as _, 0x1FFF_7A2C as _, 0x1FFF_7A2E as _];

/// The converter, and the microcontroller's state by its codes.
pub struct Analogue {
    chip: Chip,
    /// The supply's last conversion.
    supply_mv: u16,
    /// True if the converter was still busy in the last frame.
    waited: bool,
}

impl Analogue {
    /// Powers the converter up and starts it. Comes after [`super::scan::Scan::new`]: one reset is all converters'.
    pub fn new(_adc: Peri<'static, ADC1>, pin: Peri<'static, PA0>) -> Self {
        pins::analog([pin.into()]);
        rcc::enable_and_reset::<ADC1>();
        set_clock();
        // The battery's divider, on the sensor's input too, stays off.
        pac::ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(true));
        set_sequence(pac::ADC1, [SUPPLY], sample_time(84));
        // Reference and sensor want 10 us (DS10693): 480 cycles are 23.
        pac::ADC1.smpr1().write(|w| {
            for channel in [REFERENCE, SENSOR] {
                w.set_smp(usize::from(channel) - 10, sample_time(480));
            }
        });
        // Of two, the third and the fourth place are taken (RM0390, ADC_JSQR).
        pac::ADC1.jsqr().write(|w| {
            w.set_jl(1);
            w.set_jsq(2, REFERENCE);
            w.set_jsq(3, SENSOR);
        });
        pac::ADC1.cr1().write(|w| {
            w.set_scan(true);
            w.set_jauto(true);
        });
        pac::ADC1.cr2().write(|w| w.set_adon(true));
        // Both wake within 10 us (DS10693), the converter within 3.
        cortex_m::asm::delay(10 * 168);
        start();
        // SAFETY: aligned, in the microcontroller's system memory, and always readable.
        let [reference, cold, hot] = FACTORY.map(|code| unsafe { code.read_volatile() });
        Self { chip: Chip::new(Factory { reference, sensor: [cold, hot] }), supply_mv: 0, waited: false }
    }

    /// Takes the last conversions and starts the next. A converter that is not done within two frames reads as no supply,
    /// which stops the motor.
    pub fn take(&mut self) {
        let status = pac::ADC1.sr().read();
        self.waited = !status.jeoc() && !self.waited;
        if self.waited {
            return;
        }
        let code = u32::from(pac::ADC1.dr().read().data());
        let codes = status.jeoc().then(|| [0, 1].map(|place| pac::ADC1.jdr(place).read().jdata()));
        self.supply_mv = if status.eoc() { ((code * FULL_SCALE_MV) >> 12) as u16 } else { 0 };
        start();
        if self.chip.observe(codes) {
            health::set_analogue_mv(self.chip.analogue_mv());
        }
    }

    /// The supply's last conversion in mV.
    pub fn supply_mv(&self) -> u16 {
        self.supply_mv
    }

    /// The microcontroller's temperature; none before its first mean, or where the factory left no codes.
    pub fn chip(&self) -> Option<Celsius> {
        self.chip.temperature()
    }
}

/// Clears the flags and starts the next conversions.
fn start() {
    pac::ADC1.sr().write_value(pac::adc::regs::Sr(0));
    pac::ADC1.cr2().modify(|w| w.set_swstart(true));
}

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
