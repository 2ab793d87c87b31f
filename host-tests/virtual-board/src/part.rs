//! The STM32F427 of `rigless` with additions that the image needs.
//!
//! - TIM8's update request reaches DMA2 stream 1 channel 7 (RM0390 table 29), and its compare 1 the converters.
//! - The window watchdog, see `WindowWatchdog`.
//! - The core may read a received byte before the DMA fetches it, see [`crate::wire`].
//! - TIM1 counts what moves the phase of the PWM, see [`crate::timers`].
//! - A divider of the PLL that the manual forbids is reported as a gap, see `clock`.
//! - The converters take external triggers and read the fingertip's array; DMA2 takes their words a sequence at a time.

use crate::converter::Converter;
use crate::flash;
use crate::front_end::Shared;
use crate::streams::Streams;
use crate::timers::{PwmTimer, ScanTimer};
use crate::window_watchdog::WindowWatchdog;
use crate::wire::{BusPort, Wire};
use rigless::device::{Device, ErasedDevice, Level, RegisterFile, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::generated::c_adc::{self, ccr};
use rigless::soc::stm32f427::generated::flash::{Register as FlashRegister, optcr};
use rigless::soc::stm32f427::generated::rcc::{Register, apb1enr, csr};
use rigless::soc::stm32f427::peripherals::gpio::Pin;
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::soc::stm32f427::peripherals::{CONVERTERS, SERIAL_INTERFACES};
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

/// The clock that the ST-LINK feeds to PH0.
const HSE_HZ: u64 = 8_000_000;
/// The microcontroller's supply.
const VDD_MV: u32 = 3_300;
/// Clock of the buses after reset, Hz: the internal oscillator.
const RESET_HZ: u64 = 16_000_000;
const WINDOW_WATCHDOG: &str = "WWDG";
/// TIM3 in the part's list of timers.
const TIM3: usize = 1;

/// The least time between two edges of the encoder: more than the timer's filter takes.
const EDGE_NS: u64 = 250;

/// Who answers for a slot of the bus.
#[derive(Clone, Copy, Debug)]
enum Model {
    /// The crate's part.
    Chip,
    BusPort,
    Converter(usize),
    PwmTimer,
    ScanTimer,
    Streams,
    WindowWatchdog,
    /// Nobody: the image does not use the SPIs, and they would hear every request of the scan.
    None,
}

#[derive(Debug)]
pub struct Part {
    /// All that the crate's part has; its own USART2, converters, TIM1 and TIM8 are not used.
    pub chip: Stm32f427,
    bus_port: BusPort,
    converters: [Converter; 3],
    pwm_timer: PwmTimer,
    scan_timer: ScanTimer,
    streams: Streams,
    window_watchdog: WindowWatchdog,
    /// Phase of the encoder in its quadrature cycle, 0 to 3.
    quarter: u8,
    bridge_well: bool,
    front_end: Shared,
    layout: Bus,
    /// True while the emulator lays out memory: the bus then includes the device that programs the flash.
    pub laying_out: bool,
    wiring: Vec<Model>,
    /// Slots of USART2, TIM1 and the registers that the converters share.
    port_slot: usize,
    pwm_slot: usize,
    common_slot: usize,
}

impl Part {
    /// Out of power-on, with nothing run: the converters on a front end, and bits 3:2 of the option bytes.
    pub fn new(front_end: Shared, brown_out_bits: u8) -> Result<Self, Error> {
        let chip = Stm32f427::new()?;
        let mut wiring = vec![Model::Chip; chip.bus().slots().len()];
        for (nth, name) in CONVERTERS.iter().enumerate() {
            wiring[chip.bus().slot(name)?] = Model::Converter(nth);
        }
        let port_slot = chip.bus().slot("USART2")?;
        let pwm_slot = chip.bus().slot("TIM1")?;
        let common_slot = chip.bus().slot("C_ADC")?;
        wiring[port_slot] = Model::BusPort;
        wiring[pwm_slot] = Model::PwmTimer;
        wiring[chip.bus().slot("TIM8")?] = Model::ScanTimer;
        wiring[chip.bus().slot("DMA2")?] = Model::Streams;
        wiring[chip.bus().slot(WINDOW_WATCHDOG)?] = Model::WindowWatchdog;
        for name in SERIAL_INTERFACES {
            wiring[chip.bus().slot(name)?] = Model::None;
        }
        let layout = flash::layout(chip.bus())?;
        let mut part = Self {
            chip,
            bus_port: BusPort::new(RESET_HZ),
            converters: Self::converters(&front_end),
            pwm_timer: PwmTimer::new(RESET_HZ),
            scan_timer: ScanTimer::new(RESET_HZ, front_end.clone()),
            streams: Streams::new(front_end.clone()),
            window_watchdog: WindowWatchdog::default(),
            quarter: 0,
            bridge_well: true,
            front_end,
            layout,
            laying_out: false,
            wiring,
            port_slot,
            pwm_slot,
            common_slot,
        };
        part.drive_inputs(VirtualNanos(0));
        part.chip.rcc.attach_crystals(HSE_HZ, 0);
        part.chip.set_supply(VDD_MV);
        let (flash, registers) = part.chip.program();
        let loaded = optcr::BOR_LEV.set(registers.get(FlashRegister::Optcr), brown_out_bits.into());
        flash.keep_options(loaded, registers.get(FlashRegister::Optcr1), registers);
        Ok(part)
    }

    fn converters(front_end: &Shared) -> [Converter; 3] {
        std::array::from_fn(|nth| Converter::new(nth, front_end.clone(), RESET_HZ / 2))
    }

    pub fn wire(&mut self) -> &mut Wire {
        self.bus_port.wire()
    }

    pub fn pwm_timer(&self) -> (&PwmTimer, &RegisterFile) {
        (&self.pwm_timer, self.chip.bus().slots()[self.pwm_slot].registers())
    }

    /// Moves the encoder by quarter cycles, positive forward, evenly over the time that has just passed, for the timer
    /// filters its inputs. Says how many it moved: of an impossible speed the rest is left for later.
    pub fn turn_encoder(&mut self, from_ns: u64, to_ns: u64, quarters: i32) -> i32 {
        let most = ((to_ns - from_ns) / EDGE_NS) as i32;
        let moved = quarters.clamp(-most, most);
        let edges = u64::from(moved.unsigned_abs());
        for edge in 1..=edges {
            let step = if moved > 0 { 1 } else { 3 };
            self.quarter = (self.quarter + step) % 4;
            self.drive_encoder(VirtualNanos(from_ns + (to_ns - from_ns) * edge / (edges + 1)));
        }
        moved
    }

    /// Sets the bridge's nFAULT: the pin and the timer's break behind it.
    pub fn set_bridge_well(&mut self, at: VirtualNanos, well: bool) {
        self.bridge_well = well;
        let level = Level::from(well);
        self.hold_pin(at, 1, 12, level);
        let (registers, mut context) = self.chip.bus_mut().drive(at, self.pwm_slot);
        self.pwm_timer.timer.drive_break(level, registers, &mut context);
    }

    fn drive_encoder(&mut self, at: VirtualNanos) {
        let (a, b) = [(false, false), (true, false), (true, true), (false, true)][usize::from(self.quarter)];
        self.chip.drive_timer(at, TIM3, |timer, registers, context| {
            for (number, level) in [(1, a), (2, b)] {
                let channel = Channel::new(number).expect("timers have channels 1 and 2");
                timer.drive_input(channel, Level::from(level), registers, context);
            }
        });
    }

    /// Resets the part. The crate's part has one watchdog only: a reset by the other one sets its flag here.
    fn reset_chip(&mut self, at: VirtualNanos, cause: ResetCause) {
        if cause != ResetCause::Model(WINDOW_WATCHDOG) {
            return self.chip.reset(at, cause);
        }
        self.chip.reset(at, ResetCause::Model("IWDG"));
        let (_, registers) = self.chip.clocks();
        let flags = csr::WDGRSTF.set(registers.get(Register::Csr), 0);
        registers.set(Register::Csr, csr::WWDGRSTF.set(flags, 1));
    }

    fn drive_inputs(&mut self, at: VirtualNanos) {
        self.set_bridge_well(at, self.bridge_well);
        self.drive_encoder(at);
        // nSLEEP is pulled down outside; the bus idles high.
        self.hold_pin(at, 2, 9, Level::Low);
        self.hold_pin(at, 0, 3, Level::High);
    }

    fn hold_pin(&mut self, at: VirtualNanos, port: usize, pin: u8, level: Level) {
        self.chip.drive_port(at, port, |port, registers, context| {
            port.drive(Pin::new(pin).expect("ports have 16 pins"), Some(level), registers, context);
        });
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        if self.laying_out { &self.layout } else { self.chip.bus() }
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.chip.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.reset_chip(at, cause);
        Device::reset(&mut self.bus_port);
        self.window_watchdog = WindowWatchdog::default();
        self.streams = Streams::new(self.front_end.clone());
        self.converters = Self::converters(&self.front_end);
        self.pwm_timer = PwmTimer::new(RESET_HZ);
        self.scan_timer = ScanTimer::new(RESET_HZ, self.front_end.clone());
        self.front_end.lock().restart(at.0);
        self.drive_inputs(at);
    }

    fn poll(&mut self, now: VirtualNanos) {
        // Of all models only the bus has something outside, and stops come often.
        let (registers, mut context) = self.chip.bus_mut().drive(now, self.port_slot);
        Device::poll(&mut self.bus_port, registers, &mut context);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let own: Option<&mut dyn ErasedDevice> = match self.wiring.get(slot) {
            Some(Model::Converter(nth)) => {
                let common = self.chip.bus().slots()[self.common_slot].registers().get(c_adc::Register::Ccr);
                self.converters[*nth].inside_on = ccr::TSVREFE.is_set(common) && !ccr::VBATE.is_set(common);
                Some(&mut self.converters[*nth])
            }
            Some(Model::BusPort) => Some(&mut self.bus_port),
            Some(Model::PwmTimer) => Some(&mut self.pwm_timer),
            Some(Model::ScanTimer) => Some(&mut self.scan_timer),
            Some(Model::Streams) => Some(&mut self.streams),
            Some(Model::WindowWatchdog) => {
                let (clocks, registers) = self.chip.clocks();
                let enabled = apb1enr::WWDGEN.is_set(registers.get(Register::Apb1enr));
                self.window_watchdog.clock_hz = clocks.pclk1(registers);
                enabled.then_some(&mut self.window_watchdog as &mut dyn ErasedDevice)
            }
            Some(Model::None) => None,
            Some(Model::Chip) | None => return self.chip.split(slot),
        };
        (self.chip.bus_mut(), own)
    }
}
