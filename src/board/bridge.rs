//! The motor: its H-bridge and its encoder.
//!
//! TIM1 makes the bridge's two inputs, PC9 wakes it, PB12 breaks it. TIM3 counts the quadrature encoder, unwrapped to
//! 32 bits.
//!
//! | state | nSLEEP | main output enable | IN1, IN2 |
//! | --- | --- | --- | --- |
//! | safe | low | off | low, low: coast |
//! | ready | high | off | low, low: coast |
//! | driving | high | on | slow decay: one input high, the other low for the share of the duty |
//! | braking | high | on | high, high: the motor is shorted |

use embassy_stm32::gpio::{Pull, Speed};
use embassy_stm32::pac::timer::regs::SrAdv;
use embassy_stm32::pac::timer::vals::{Bkp, CcmrInputCcs, FilterValue, Ocm, Ossi, Ossr, Sms};
use embassy_stm32::peripherals::{PA8, PA9, PB12, PC6, PC7, PC9, TIM1, TIM3};
use embassy_stm32::{Peri, pac, rcc};
use fingertip::pipeline::Bridge as Requested;
use fingertip::scan::ScanTiming;
use fingertip::units::{Duty, ScanTicks};

use super::{guard, pins};

/// The longest period, 168 MHz / 8400 = 20 kHz. TIM1 and the scan's TIM8 count the same clock.
const LONGEST: ScanTicks = ScanTicks(8_400);
/// The driver wants 1 ms from nSLEEP to its first output; nFAULT means nothing before.
const WAKE_TICKS: u32 = guard::HZ / 1_000;
const TIM1_FUNCTION: u8 = 1;
const NSLEEP: usize = 9;
const NFAULT: usize = 12;

/// Cuts the bridge: outputs low, driver asleep. Callable from anywhere, at any time, any number of times.
pub fn make_safe() {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::GPIOC.bsrr().write(|w| w.set_br(NSLEEP, true));
}

/// Returns true if the hardware shows that the bridge is cut.
pub fn is_safe() -> bool {
    !pac::TIM1.bdtr().read().moe() && pac::GPIOC.odr().read().odr(NSLEEP) == pac::gpio::vals::Odr::LOW
}

/// The bridge's inputs.
pub struct Bridge {
    /// Time at which nSLEEP went high, while it is high.
    woken: Option<u32>,
    ready: bool,
    driving: bool,
    period_ticks: u16,
}

impl Bridge {
    /// Outputs low, driver asleep, break armed.
    pub fn new(
        _timer: Peri<'static, TIM1>,
        in1: Peri<'static, PA8>,
        in2: Peri<'static, PA9>,
        nfault: Peri<'static, PB12>,
        nsleep: Peri<'static, PC9>,
    ) -> Self {
        pins::low_output(nsleep.into(), Speed::Low);
        rcc::enable_and_reset::<TIM1>();
        let timer = pac::TIM1;
        let period_ticks = LONGEST.0 as u16;
        timer.arr().write(|w| w.set_arr(period_ticks - 1));
        timer.cr1().modify(|w| w.set_arpe(true));
        set_preload(true);
        timer.ccer().modify(|w| {
            w.set_cce(0, true);
            w.set_cce(1, true);
        });
        // Off means driven low (OSSI with idle levels of 0), and only software turns the outputs on (AOE stays 0).
        timer.bdtr().write(|w| {
            w.set_ossi(Ossi::IDLE_LEVEL);
            w.set_ossr(Ossr::IDLE_LEVEL);
            w.set_bkp(0, Bkp::ACTIVE_LOW);
            w.set_bke(0, true);
        });
        timer.egr().write(|w| w.set_ug(true));
        timer.cr1().modify(|w| w.set_cen(true));
        pins::input(nfault, TIM1_FUNCTION, Pull::Up);
        pins::timer_output(in1, TIM1_FUNCTION, Speed::High);
        pins::timer_output(in2, TIM1_FUNCTION, Speed::High);
        Self { woken: None, ready: false, driving: false, period_ticks }
    }

    /// Begins a period, and makes a frame a whole number of them: from a start of the scan on, the edges of a duty meet
    /// the same rows in each frame.
    pub fn keep_step(&mut self, timing: ScanTiming) {
        self.period_ticks = timing.whole_part(LONGEST).0 as u16;
        pac::TIM1.arr().write(|w| w.set_arr(self.period_ticks - 1));
        pac::TIM1.egr().write(|w| w.set_ug(true));
    }

    /// Sets the state that the pipeline requests. A sleeping driver is not woken to brake.
    pub fn apply(&mut self, requested: Requested) {
        match requested {
            Requested::Asleep => self.sleep(),
            Requested::Open => {
                self.coast();
                self.wake();
            }
            Requested::Brakes if self.ready => self.drive(Duty::ZERO, true),
            Requested::Brakes => self.sleep(),
            Requested::Driven(duty) => {
                self.wake();
                if self.ready {
                    self.drive(duty, false);
                }
            }
        }
        // The guard may have cut the bridge meanwhile; then the bridge must remain cut.
        if guard::tripped() {
            self.sleep();
        }
    }

    /// Cuts the bridge and remembers it.
    pub fn sleep(&mut self) {
        make_safe();
        *self = Self { woken: None, ready: false, driving: false, period_ticks: self.period_ticks };
    }

    /// Returns true if an awake driver reports a fault, or the hardware cut an output that should be on.
    pub fn fault(&self) -> bool {
        let reported = pac::GPIOB.idr().read().idr(NFAULT) == pac::gpio::vals::Idr::LOW;
        (self.ready && reported) || (self.driving && !pac::TIM1.bdtr().read().moe())
    }

    fn wake(&mut self) {
        let now = guard::now();
        match self.woken {
            None => {
                pac::GPIOC.bsrr().write(|w| w.set_bs(NSLEEP, true));
                self.woken = Some(now);
            }
            Some(woken) if !self.ready => self.ready = now.wrapping_sub(woken) >= WAKE_TICKS,
            Some(_) => {}
        }
    }

    fn coast(&mut self) {
        if self.driving {
            pac::TIM1.bdtr().modify(|w| w.set_moe(false));
            self.driving = false;
        }
    }

    /// Drives the motor from the next period on, or shorts it `at_once`: a fault does not wait for half a frame.
    fn drive(&mut self, duty: Duty, at_once: bool) {
        let period = self.period_ticks;
        let low = ticks_low(duty, period);
        let (in1, in2) = if duty < Duty::ZERO { (low, 0) } else { (0, low) };
        let at_once = at_once || !self.driving;
        if at_once {
            // The compare values count before the outputs come on. An update event would do it too, but begin a period.
            set_preload(false);
        }
        pac::TIM1.ccr(0).write(|w| w.set_ccr(period - in1));
        pac::TIM1.ccr(1).write(|w| w.set_ccr(period - in2));
        if at_once {
            set_preload(true);
        }
        if !self.driving {
            // Forget an old break.
            let mut cleared = SrAdv(u32::MAX);
            cleared.set_bif(0, false);
            pac::TIM1.sr().write_value(cleared);
            pac::TIM1.bdtr().modify(|w| w.set_moe(true));
            self.driving = true;
        }
    }
}

/// Turns the preload of the compare values on or off. It is off only while the outputs are off, or when both values
/// become constant: without it RM0390 (OC1PE) guarantees no PWM.
#[inline(never)]
fn set_preload(on: bool) {
    pac::TIM1.ccmr_output(0).write(|w| {
        for channel in 0..2 {
            w.set_ocm(channel, Ocm::PWM_MODE1);
            w.set_ocpe(channel, on);
        }
    });
}

/// The share of the period for which one input is low, ticks, rounded.
fn ticks_low(duty: Duty, period: u16) -> u16 {
    let share = u32::from(duty.0.unsigned_abs().min(Duty::FULL.unsigned_abs()));
    ((share * u32::from(period) + (1 << 14)) >> 15) as u16
}

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
