//! The board: microcontroller, clock, supply, the parts at its pins, and the world around it.

use crate::bench::STEP_NS;
use crate::converter::ROOM_C;
use crate::part::Part;
use crate::scene::finger::Finger;
use rigless::device::Level;
use rigless::machine::armv7m::{Core, Fpu, MpuRegions, Variant};
use rigless::machine::{Board, Target};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};
use rigless::soc::stm32f427::peripherals::tim::Channel;
use sim::mechanics::Bridge;
use sim::plant::{Plant, Setup};
use std::num::{NonZeroU32, NonZeroU64};

const CORE_HZ: NonZeroU64 = NonZeroU64::new(168_000_000).expect("the core is clocked");
/// Instructions that the core retires in a second: a CPI of 1.34 at 168 MHz, as the control step is estimated.
const INSTRUCTIONS_PER_SECOND: NonZeroU64 = NonZeroU64::new(125_000_000).expect("the core runs");
/// Divider of the SysTick clock.
const REFCLK_DIVIDER: NonZeroU32 = NonZeroU32::new(8).expect("a divider divides");
const PORT_A: usize = 0;
const PORT_C: usize = 2;
/// TIM1's alternate function on PA8 and PA9.
const TIM1_FUNCTION: u8 = 1;

// A run has no snapshot.
impl Store for Part {}

impl Part {
    /// Returns true while the transceiver drives the line.
    pub fn transmits(&mut self) -> bool {
        level(self, PORT_C, 8) == Level::High
    }

    /// State of the bridge, from IN1 and IN2 averaged over the PWM period. It coasts while nSLEEP or both inputs are low.
    pub fn bridge(&mut self) -> Bridge {
        if level(self, PORT_C, 9) == Level::Low {
            return Bridge::Coast;
        }
        let (in1, in2) = (self.high_share(1, 8), self.high_share(2, 9));
        if in1 == 0.0 && in2 == 0.0 { Bridge::Coast } else { Bridge::Driven { duty: in1 - in2 } }
    }

    /// The share of the time that a bridge input is high; low when its pin is not the timer's (pulled down outside).
    fn high_share(&mut self, channel: u8, pin: u8) -> f64 {
        let pin = Pin::new(pin).expect("ports have 16 pins");
        let (_, registers) = self.chip.port(PORT_A);
        if Gpio::function(pin, registers) != Some(TIM1_FUNCTION) {
            return 0.0;
        }
        let channel = Channel::new(channel).expect("timers have channels 1 and 2");
        let (timer, registers) = self.pwm_timer();
        timer.high_share(channel, registers)
    }
}

fn level(part: &mut Part, port: usize, pin: u8) -> Level {
    let (port, registers) = part.chip.port(port);
    port.level(Pin::new(pin).expect("ports have 16 pins"), registers)
}

impl Board for Part {
    fn name(&self) -> &'static str {
        "fingertip"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        self.laying_out = false;
        (target == 0).then_some(self)
    }

    /// The emulator asks for the targets when it lays out memory, and for the microcontroller from then on.
    fn targets(&mut self) -> Vec<Target<'_>> {
        self.laying_out = true;
        let lines = u32::from(self.cpu().interrupt_lines);
        let core = Core {
            variant: Variant::M4,
            clock_hz: CORE_HZ,
            interrupt_lines: NonZeroU32::new(lines).expect("the part has interrupts"),
            priority_bits: 4,
            refclk_divider: REFCLK_DIVIDER,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            boot: "flash",
        }
        .spec_with_parts(&rigless::cpu::armv7m::windows(self.bus()), Fpu::FpV4Sp, MpuRegions::Eight);
        vec![Target::new("stm32", self, core)]
    }
}

/// The world behind the board's pins: the plant of `sim`, or one finger in the world of a scene.
#[derive(Debug)]
pub enum Surroundings {
    Plant(Box<Plant>),
    Scene(Box<Finger>),
}

impl Surroundings {
    pub fn plant(setup: &Setup) -> Self {
        Self::Plant(Box::new(Plant::new(setup)))
    }

    /// Goes from one instant of the board to another with the bridge held.
    pub fn advance(&mut self, from_ns: u64, to_ns: u64, bridge: Bridge) {
        let dt_s = (to_ns - from_ns) as f64 * 1e-9;
        match self {
            Self::Plant(world) => world.advance(dt_s, bridge),
            Self::Scene(finger) => finger.advance(to_ns),
        }
    }

    /// Sets the bridge state from now on. The plant gets it with each step instead.
    pub fn hold(&mut self, bridge: Bridge) {
        if let Self::Scene(finger) = self {
            finger.bridge = bridge;
        }
    }

    /// Time between two steps of the world, ns.
    pub fn grid_ns(&self) -> u64 {
        match self {
            Self::Plant(_) => STEP_NS,
            Self::Scene(finger) => finger.grid_ns(),
        }
    }

    pub fn supply_v(&self) -> f64 {
        match self {
            Self::Plant(world) => world.finger().supply_v(),
            Self::Scene(finger) => finger.supply_v(),
        }
    }

    /// The microcontroller's temperature.
    pub fn chip_c(&self, at_ns: u64) -> f64 {
        match self {
            Self::Plant(_) => ROOM_C,
            Self::Scene(finger) => finger.chip_c(at_ns),
        }
    }

    /// Unwrapped counts of the timer in encoder mode at a board time.
    pub fn encoder_counts(&self, at_ns: u64) -> i32 {
        match self {
            Self::Plant(world) => world.encoder_counts(),
            Self::Scene(finger) => finger.encoder_counts(at_ns),
        }
    }

    /// Costs of a scene's effects.
    pub fn costs(&self) -> Vec<sim::watch::Cost> {
        if let Self::Scene(finger) = self { finger.costs() } else { Vec::new() }
    }

    pub fn reference_v(&self) -> f64 {
        match self {
            Self::Plant(world) => world.finger().setup.array.reference_v,
            Self::Scene(finger) => finger.reference_v,
        }
    }
}
