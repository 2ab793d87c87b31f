//! Timers of the bridge and of the scan, which sleep while nothing that they do is observed.

use crate::front_end::Shared;
use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32f427::generated::tim1::{bdtr, ccer, ccmr1_output, cr1, egr};
use rigless::soc::stm32f427::peripherals::tim::{Advanced, Channel, Counter, Family, Tim, UPDATE_REQUEST};
use rigless::time::{EventId, VirtualNanos};

type Register = <Advanced as Family>::Register;

/// TIM1, the bridge's timer, which sleeps while its registers do not change.
///
/// The crate's timer wakes at each edge that it makes, 50,000 times a virtual second, and the emulated core is stopped
/// each time. Nothing depends on these edges: the world only uses the duty, which follows from the registers in use
/// ([`Tim::pulse`]). Written values are in use from the next update on. So the timer stays awake until that update,
/// then sleeps until it is read or written; it then catches up by itself.
#[derive(Debug)]
pub struct PwmTimer {
    pub timer: Tim<Advanced>,
    clock_hz: u64,
    awake_until_ns: u64,
    on: bool,
    pub counts: Counts,
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

    /// Keeps the timer awake until the present period has ended and written values are in use, rounded up to 1 ns.
    fn wake(&mut self, registers: &RegisterFile, now: VirtualNanos) {
        let cycles = self.period_ticks(registers) * (registers.get(Register::Psc) + 1);
        self.awake_until_ns = now.0 + (cycles * 1_000_000_000).div_ceil(self.clock_hz.max(1)) + 1;
    }
}

impl Device for PwmTimer {
    type Register = Register;

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

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.timer, registers, context);
    }
}

/// The request output on which the rising edge of channel 1's reference is announced: beyond the timer's own.
pub const COMPARE_1: usize = 32;
const PWM_MODE_2: u64 = 0b111;
const CHANNEL_1: Channel = Channel::new(1).expect("timers have a channel 1");

/// TIM8. Reports two events that the crate's timer does not: its first channel's edge, and a served update request.
///
/// In a scene the edge is no separate event, and only updates that raise an interrupt are events, see
/// [`crate::front_end::Scan`]: the timer sleeps through the other updates, and catches up with them.
#[derive(Debug)]
pub struct ScanTimer {
    timer: Tim<Advanced>,
    updates_seen: u64,
    updates_served: u64,
    reference: Level,
    clock_hz: u64,
    updates: Updates,
    /// In a scene: the next scheduled wake-up, and the number of updates until then.
    wake: Option<(EventId, usize)>,
    front_end: Shared,
}

impl ScanTimer {
    /// Out of reset, on a clock.
    pub fn new(clock_hz: u64, front_end: Shared) -> Self {
        Self {
            timer: Tim::with_clock(clock_hz, Counter::Narrow),
            updates_seen: 0,
            updates_served: 0,
            reference: Level::Low,
            clock_hz,
            updates: Updates::default(),
            wake: None,
            front_end,
        }
    }

    /// Keeps the first channel's compare from the timer in a scene: it would be an event in each slot.
    fn take_edge(&mut self, ticks: u64, registers: &mut RegisterFile) -> bool {
        let mut front_end = self.front_end.lock();
        let Some(scan) = &mut front_end.scan else { return false };
        scan.edge_ns = (ticks * 1_000_000_000).div_ceil(self.clock_hz.max(1));
        registers.set(Register::Ccr1, 0);
        true
    }

    /// Raises channel 1's reference if the compare is set below a stopped counter: without preload it takes effect at
    /// once. The crate's timer compares only while it runs.
    fn compare_standing(&self, compare: u64, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let mode = registers.get(Register::Ccmr1Output);
        let immediate = !ccmr1_output::OC1PE.is_set(mode) && ccmr1_output::OC1M.get(mode) == PWM_MODE_2;
        let still = !cr1::CEN.is_set(registers.get(Register::Cr1)) && ccer::CC1E.is_set(registers.get(Register::Ccer));
        let count = Device::peek(&self.timer, Register::Cnt, registers, context.now());
        let count = count.unwrap_or(registers.get(Register::Cnt));
        if immediate && still && self.reference == Level::Low && count >= compare {
            context.request(COMPARE_1, Level::High);
        }
    }

    fn announce(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let reference = self.timer.reference(CHANNEL_1);
        if reference != self.reference {
            self.reference = reference;
            if reference == Level::High {
                context.request(COMPARE_1, Level::High);
            }
        }
        let updates = self.timer.dma_requests().update;
        if updates != self.updates_seen {
            // The controller moves one item for a request and does not touch the timer, so the request ends here.
            self.updates_seen = updates;
            self.tell_due(updates.saturating_sub(self.updates_served) as usize, context.now().0);
            self.timer.acknowledge(UPDATE_REQUEST, registers, context);
            self.sleep(context);
        }
    }

    /// In a scene: queues the `passed` updates; while the timer is stopped, the one update that the image generated.
    fn tell_due(&mut self, passed: usize, now_ns: u64) {
        self.updates_served += passed as u64;
        if let Some(scan) = &mut self.front_end.lock().scan {
            scan.due_ns.extend(self.updates.next_ns(passed));
            if self.updates.running.is_none() {
                scan.due_ns.push_back(now_ns);
            }
        }
        self.updates.pass(passed);
    }

    /// In a scene: sleeps until the next update that raises an interrupt.
    fn sleep(&mut self, context: &mut DeviceContext<'_>) {
        let mut front_end = self.front_end.lock();
        self.wake = front_end.updates_to_sleep().and_then(|count| {
            let at_ns = self.updates.next_ns(count).next_back()?;
            front_end.expect(self.updates.next_ns(count));
            Some((context.schedule(VirtualNanos(at_ns)), count))
        });
    }

    /// Starts or stops the updates if the image started or stopped the timer.
    fn follow(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let runs = cr1::CEN.is_set(registers.get(Register::Cr1));
        if runs == self.updates.running.is_some() {
            return;
        }
        if runs {
            let cycles = (registers.get(Register::Arr) + 1) * (registers.get(Register::Psc) + 1);
            self.updates.start(context.now().0, cycles);
        } else {
            self.updates.running = None;
        }
        self.sleep(context);
    }
}

impl Device for ScanTimer {
    type Register = Register;

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        let value = Device::read(&mut self.timer, register, file, context);
        self.announce(file, context);
        value
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        Device::peek(&self.timer, register, registers, now)
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        // The second channel is the first's copy on a pin that leads nowhere: its compare would be an event in each slot.
        let idle = register == Register::Ccr2;
        let taken = idle || register == Register::Ccr1 && self.take_edge(value, registers);
        if register == Register::Ccr1 && !taken {
            self.compare_standing(value, registers, context);
        }
        Device::write(&mut self.timer, register, if taken { 0 } else { value }, registers, context);
        self.announce(registers, context);
        self.follow(registers, context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match self.wake {
            None => {
                Device::on_event(&mut self.timer, event, registers, context);
                self.announce(registers, context);
            }
            // The timer itself catches up when the image looks at it next.
            Some((wake, passed)) if wake == event => {
                self.tell_due(passed, context.now().0);
                context.request(UPDATE_REQUEST, Level::High);
                context.request(UPDATE_REQUEST, Level::Low);
                self.sleep(context);
            }
            Some(_) => {}
        }
    }

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_request(&mut self.timer, change, registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
        self.updates.clock(hz, context.now().0);
        Device::on_clock(&mut self.timer, hz, registers, context);
        self.announce(registers, context);
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.timer, registers, context);
        self.reference = Level::Low;
        self.updates_seen = self.timer.dma_requests().update;
        self.updates_served = self.updates_seen;
        self.updates.running = None;
        self.wake = None;
    }
}

const NS: u128 = 1_000_000_000;

/// Times of the updates of a running timer, exact to a cycle of its clock.
#[derive(Clone, Copy, Debug, Default)]
struct Updates {
    hz: u64,
    /// Time at which the count of cycles begins, ns.
    epoch_ns: u64,
    /// Cycle of the last update or of the start, and cycles between updates; `None` while the timer is stopped.
    running: Option<(u64, u64)>,
}

impl Updates {
    /// Sets the clock rate from a time on, and stops the timer.
    fn clock(&mut self, hz: u64, at_ns: u64) {
        *self = Self { hz, epoch_ns: at_ns, running: None };
    }

    /// Starts the timer from 0, with an update every `cycles` cycles.
    fn start(&mut self, at_ns: u64, cycles: u64) {
        let since = u128::from(at_ns - self.epoch_ns) * u128::from(self.hz) / NS;
        self.running = Some((since as u64, cycles));
    }

    /// Times of the next `count` updates, ns; empty while the timer is stopped.
    fn next_ns(&self, count: usize) -> impl DoubleEndedIterator<Item = u64> + use<> {
        let Self { hz, epoch_ns, running } = *self;
        let (last, cycles) = running.unwrap_or_default();
        let count = if running.is_some() { count as u64 } else { 0 };
        (1..=count).map(move |nth| {
            let cycle = u128::from(last + nth * cycles);
            epoch_ns + (cycle * NS).div_ceil(u128::from(hz.max(1))) as u64
        })
    }

    fn pass(&mut self, count: usize) {
        if let Some((last, cycles)) = &mut self.running {
            *last += count as u64 * *cycles;
        }
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

    /// The bridge's timer, running: period, PWM mode 1 with preload, output on; `main_output` turns it on.
    fn running(main_output: bool) -> Single<PwmTimer> {
        let mut part = Single::new(builder(), "TIM1", PwmTimer::new(CLOCK_HZ)).expect("the part has a TIM1");
        let main_output = if main_output { 1 << 15 } else { 0 };
        for (offset, value) in [(0x2c, 6_719), (0x18, 0x68), (0x20, 1), (0x44, main_output), (0x14, 1), (0x00, 0x81)] {
            write(&mut part, 0, offset, value);
        }
        part
    }

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
        let mut part = running(true);
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
        let mut part = running(false);
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
        assert_eq!(part.pair().0.counts, Counts { turned_on: 10_000, restarted: 0 });
        write(&mut part, 2_000_000_000, 0x14, 1);
        assert_eq!(part.pair().0.counts.restarted, 1);
    }

    #[test]
    fn updates_are_at_the_first_whole_instant_behind_their_cycle_for_a_day() {
        let mut updates = Updates::default();
        updates.clock(168_000_000, 1_000);
        assert_eq!(updates.next_ns(3).next(), None);
        // 7 cycles are 41.7 ns; the start lies 100 ns, 16.8 cycles, behind the epoch.
        updates.start(1_100, 7);
        assert_eq!(updates.next_ns(3).collect::<Vec<_>>(), [1_137, 1_179, 1_221]);
        updates.pass(2);
        assert_eq!(updates.next_ns(1).collect::<Vec<_>>(), [1_221]);
        // A day of updates loses no cycle.
        updates.clock(168_000_000, 0);
        updates.start(0, 1_524);
        let day: u64 = 86_400 * 168_000_000 / 1_524;
        updates.pass(day as usize - 1);
        assert_eq!(updates.next_ns(1).next(), Some((u128::from(day) * 1_524 * 125).div_ceil(21) as u64));
    }
}
