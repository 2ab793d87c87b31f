//! The bridge's timer, which sleeps while its registers do not change.
//!
//! The crate's timer wakes at each edge that it makes, 50,000 times a virtual second, and the emulated core is stopped
//! each time. Nothing depends on these edges: the world only uses the duty, which follows from the registers in use
//! ([`Tim::pulse`]). Written values are in use from the next update on. So the timer stays awake until that update,
//! then sleeps until it is read or written; it then catches up by itself.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32f427::generated::tim1::{bdtr, cr1, egr};
use rigless::soc::stm32f427::peripherals::tim::{Advanced, Channel, Counter, Family, Tim};
use rigless::time::{EventId, VirtualNanos};

type Register = <Advanced as Family>::Register;

/// TIM1 of the part.
#[derive(Debug)]
pub struct PwmTimer {
    timer: Tim<Advanced>,
    clock_hz: u64,
    awake_until_ns: u64,
    on: bool,
    counts: Counts,
}

/// Events that can shift the phase of the PWM. The image must not shift it while it turns the outputs on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Number of times that the main output enable was set.
    pub turned_on: u64,
    /// Number of times that the image restarted the running counter, by an update event or by writing it.
    pub restarted: u64,
}

impl PwmTimer {
    /// Out of reset, on a clock.
    pub fn new(clock_hz: u64) -> Self {
        let timer = Tim::with_clock(clock_hz, Counter::Narrow);
        Self { timer, clock_hz, awake_until_ns: 0, on: false, counts: Counts::default() }
    }

    /// Counts since the reset.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Share of a period for which a channel's output is high; 0 if it is not driven.
    pub fn high_share(&self, channel: Channel, registers: &RegisterFile) -> f64 {
        match self.timer.pulse(channel, registers) {
            Some(pulse) => pulse.width.0 as f64 / pulse.period.0 as f64,
            None if self.timer.output(channel, registers) == Some(Level::High) => 1.0,
            None => 0.0,
        }
    }

    /// Ticks from period to period, as written last.
    pub fn period_ticks(&self, registers: &RegisterFile) -> u64 {
        registers.get(Register::Arr) + 1
    }

    /// The bridge's nFAULT.
    pub fn drive_break(&mut self, level: Level, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.drive_break(level, registers, context);
    }

    /// Keeps the timer awake until the present period has ended and written values are in use, rounded up to 1 ns.
    fn wake(&mut self, registers: &RegisterFile, now: VirtualNanos) {
        let cycles = self.period_ticks(registers) * (registers.get(Register::Psc) + 1);
        self.awake_until_ns = now.0 + (cycles * 1_000_000_000).div_ceil(self.clock_hz.max(1)) + 1;
    }
}

impl Device for PwmTimer {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        Device::layout(&self.timer)
    }

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        // No edge changes it, so the timer sleeps on: a break does, at once.
        if register == Register::Bdtr {
            return None;
        }
        Device::read(&mut self.timer, register, file, context)
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        Device::peek(&self.timer, register, registers, now)
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let restarts = register == Register::Egr && egr::UG.is_set(value) || register == Register::Cnt;
        self.counts.restarted += u64::from(restarts && cr1::CEN.is_set(registers.get(Register::Cr1)));
        if register == Register::Bdtr {
            let on = bdtr::MOE.is_set(value);
            self.counts.turned_on += u64::from(on && !self.on);
            self.on = on;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::{Operate, Single};
    use rigless::soc::Width;
    use rigless::soc::stm32f427::builder;
    use rigless::soc::stm32f427::generated::TIM1;

    const CLOCK_HZ: u64 = 168_000_000;
    /// 25 kHz.
    const PERIOD_NS: u64 = 40_000;

    fn write(part: &mut Single<PwmTimer>, at_ns: u64, offset: u64, value: u64) {
        let written = part.write(VirtualNanos(at_ns), TIM1.base + offset, Width::W32, value);
        assert_eq!(written, Ok(()));
    }

    fn share(part: &mut Single<PwmTimer>) -> f64 {
        let (timer, registers) = part.pair();
        timer.high_share(Channel::new(1).expect("a channel"), registers)
    }

    /// Runs to an instant as the emulator does; says how often it was stopped.
    fn run(part: &mut Single<PwmTimer>, to_ns: u64) -> usize {
        let mut stops = 0;
        while let Some(at) = part.next_event().filter(|at| at.0 <= to_ns) {
            part.advance_to(at);
            stops += 1;
        }
        stops
    }

    #[test]
    fn a_duty_is_in_use_from_the_next_period_on_and_nothing_wakes_after_it() {
        let timer = PwmTimer::new(CLOCK_HZ);
        let mut part = Single::new(builder(), "TIM1", timer).expect("the part has a TIM1");
        // Period, PWM mode 1 with preload, output on, main output on; begin.
        for (offset, value) in [(0x2c, 6_719), (0x18, 0x68), (0x20, 1), (0x44, 1 << 15), (0x14, 1), (0x00, 0x81)] {
            write(&mut part, 0, offset, value);
        }
        for (period, ticks) in [(3, 3_360), (10, 1_680), (11, 5_040)] {
            let before = share(&mut part);
            run(&mut part, period * PERIOD_NS + 10_000);
            write(&mut part, period * PERIOD_NS + 10_000, 0x34, ticks);
            run(&mut part, (period + 1) * PERIOD_NS - 1);
            assert_eq!(share(&mut part), before, "in period {period}");
            run(&mut part, (period + 1) * PERIOD_NS);
            assert_eq!(share(&mut part), ticks as f64 / 6_720.0, "behind period {period}");
        }
        assert!(run(&mut part, 1_000 * PERIOD_NS) <= 2);
    }

    /// The sequence with which `board::bridge` turns the outputs on.
    #[test]
    fn a_duty_written_without_preload_is_in_use_at_once_and_begins_no_period() {
        let timer = PwmTimer::new(CLOCK_HZ);
        let mut part = Single::new(builder(), "TIM1", timer).expect("the part has a TIM1");
        for (offset, value) in [(0x2c, 6_719), (0x18, 0x68), (0x20, 1), (0x14, 1), (0x00, 0x81)] {
            write(&mut part, 0, offset, value);
        }
        for turn in 1..=10_000 {
            let at_ns = turn * 100_003;
            run(&mut part, at_ns);
            for (offset, value) in [(0x44, 0), (0x18, 0x60), (0x34, turn % 6_720), (0x18, 0x68), (0x44, 1 << 15)] {
                write(&mut part, at_ns, offset, value);
            }
            assert!((share(&mut part) * 6_720.0 - (turn % 6_720) as f64).abs() < 0.5);
            let counted = part.read(VirtualNanos(at_ns), TIM1.base + 0x24, Width::W32).expect("a counter");
            assert_eq!(counted, at_ns % PERIOD_NS * CLOCK_HZ / 1_000_000_000, "turn {turn}");
        }
        assert_eq!(part.pair().0.counts(), Counts { turned_on: 10_000, restarted: 0 });
        write(&mut part, 2_000_000_000, 0x14, 1);
        assert_eq!(part.pair().0.counts().restarted, 1);
    }
}
