//! The bridge's timer, asleep where nothing of it changes.
//!
//! The crate's timer wakes at each edge that it makes, 50,000 times a virtual second, and the emulated core is stopped each time.
//! Nobody hears these edges: of the bridge the world knows the duty, which follows from the registers in use ([`Tim::pulse`]). What the
//! image writes is in use from the next update on. So the timer is let wake until that is over, and then sleeps until it is looked at
//! or driven; it catches up by itself with what it slept through.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::snapshot::store;
use rigless::soc::RegisterSpec;
use rigless::soc::stm32f427::peripherals::tim::{Advanced, Channel, Counter, Family, Tim};
use rigless::time::{EventId, VirtualNanos};

type Register = <Advanced as Family>::Register;

/// TIM1 of the part.
#[derive(Debug)]
pub struct PwmTimer {
    timer: Tim<Advanced>,
    clock_hz: u64,
    awake_until_ns: u64,
}

store!(PwmTimer { values: [timer, clock_hz, awake_until_ns], parts: [], built: [] });

impl PwmTimer {
    /// Out of reset, on a clock.
    pub fn new(clock_hz: u64) -> Self {
        Self { timer: Tim::with_clock(clock_hz, Counter::Narrow), clock_hz, awake_until_ns: 0 }
    }

    /// The share of a period for which a channel's output is high; 0 where it is not driven.
    pub fn high_share(&self, channel: Channel, registers: &RegisterFile) -> f64 {
        match self.timer.pulse(channel, registers) {
            Some(pulse) => pulse.width.0 as f64 / pulse.period.0 as f64,
            None if self.timer.output(channel, registers) == Some(Level::High) => 1.0,
            None => 0.0,
        }
    }

    /// The bridge's nFAULT.
    pub fn drive_break(&mut self, level: Level, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.drive_break(level, registers, context);
    }

    /// What is written is in use by then: the period under way has ended, at a whole instant.
    fn wake(&mut self, registers: &RegisterFile, now: VirtualNanos) {
        let cycles = (registers.get(Register::Arr) + 1) * (registers.get(Register::Psc) + 1);
        self.awake_until_ns = now.0 + (cycles * 1_000_000_000).div_ceil(self.clock_hz.max(1)) + 1;
    }
}

impl Device for PwmTimer {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        Device::layout(&self.timer)
    }

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        // No edge changes it, so the timer sleeps on: a break does, at once.
        if register == Register::Bdtr {
            return None;
        }
        Device::read(&mut self.timer, register, registers, context)
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        Device::peek(&self.timer, register, registers, now)
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.timer, register, value, registers, context);
        self.wake(registers, context.now());
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        // An event that the timer does not hear is the last that it asked for.
        if context.now().0 <= self.awake_until_ns {
            Device::on_event(&mut self.timer, event, registers, context);
        }
    }

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_request(&mut self.timer, change, registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
        Device::on_clock(&mut self.timer, hz, registers, context);
    }

    fn reset(&mut self) {
        Device::reset(&mut self.timer);
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.timer, registers, context);
    }
}
