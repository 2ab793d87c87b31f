//! The window watchdog of RM0390 chapter 20, which the crate does not have.
//!
//! It counts down once every 4096 cycles of APB1, or up to eight times as many, and resets the part when it falls from
//! 0x40, when it is set below that, or when it is fed while it is above its window. Its ticks go on through each
//! feeding, so a count lasts up to a tick less than it says. Nothing stops it. Its early interrupt is not modelled.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32f427::generated::wwdg::{Register, cfr, cr};
use rigless::time::{EventId, VirtualNanos};

/// The least count that does not bite.
const END: u64 = 0x40;
/// Cycles of APB1 in a tick at the quickest.
const CYCLES: u64 = 4_096;

#[derive(Debug, Default)]
pub struct WindowWatchdog {
    pub clock_hz: u64,
    divider: u32,
    /// The count, and the tick since time 0 in which it was that.
    since: Option<(u64, u64)>,
    /// The one scheduled event, which checks for a time-out.
    pending: Option<EventId>,
}

impl WindowWatchdog {
    fn tick(&self, now: VirtualNanos) -> u64 {
        (u128::from(now.0) * u128::from(self.clock_hz) / 1_000_000_000) as u64 / (CYCLES << self.divider)
    }

    fn count(&self, now: VirtualNanos) -> Option<u64> {
        self.since.map(|(count, tick)| count.saturating_sub(self.tick(now) - tick))
    }

    /// Time at which the count falls below its end.
    fn bites(&self) -> Option<VirtualNanos> {
        let (count, tick) = self.since?;
        let cycles = (tick + count + 1 - END) * (CYCLES << self.divider);
        let ns = (u128::from(cycles) * 1_000_000_000).div_ceil(u128::from(self.clock_hz.max(1)));
        Some(VirtualNanos(ns as u64))
    }

    fn set(&mut self, count: u64, context: &mut DeviceContext<'_>) {
        self.since = Some((count, self.tick(context.now())));
        if self.pending.is_none() {
            self.pending = self.bites().map(|at| context.schedule(at));
        }
    }
}

impl Device for WindowWatchdog {
    type Register = Register;

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        let count = self.count(now).filter(|_| register == Register::Cr)?;
        Some(cr::T.set(registers.get(Register::Cr), count))
    }

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.peek(register, file, context.now())
    }

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let count = self.count(context.now());
        match register {
            Register::Cr => {
                let early = count.is_some_and(|count| count > cfr::W.get(registers.get(Register::Cfr)));
                let runs = count.is_some() || cr::WDGA.is_set(value);
                registers.set(Register::Cr, cr::WDGA.set(value, u64::from(runs)));
                if runs && (early || cr::T.get(value) < END) {
                    context.request_reset();
                } else if runs {
                    self.set(cr::T.get(value), context);
                }
            }
            Register::Cfr => {
                self.divider = (value >> 7 & 0b11) as u32;
                if let Some(count) = count {
                    // The event under way may come too late for the new ticks.
                    self.pending = None;
                    self.set(count, context);
                }
            }
            Register::Sr => {}
        }
    }

    fn on_event(&mut self, event: EventId, _registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.pending.take_if(|pending| *pending == event).is_none() {
            return;
        }
        match self.bites() {
            Some(at) if at <= context.now() => context.request_reset(),
            at => self.pending = at.map(|at| context.schedule(at)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::{Operate, Single};
    use rigless::soc::Width;
    use rigless::soc::stm32f427::builder;
    use rigless::soc::stm32f427::generated::WWDG;

    fn running(divider: u64, count: u64) -> Single<WindowWatchdog> {
        let watchdog = WindowWatchdog { clock_hz: 42_000_000, ..WindowWatchdog::default() };
        let mut part = Single::new(builder(), "WWDG", watchdog).expect("the part has a WWDG");
        for (offset, value) in [(4, divider << 7 | 0x7f), (0, 0x80 | count)] {
            assert_eq!(part.write(VirtualNanos(1), WWDG.base + offset, Width::W32, value), Ok(()));
        }
        part
    }

    fn bites_us(part: &mut Single<WindowWatchdog>) -> u64 {
        part.next_event().expect("it bites").0 / 1_000
    }

    #[test]
    fn it_bites_when_the_manuals_formula_says() {
        // 4096 x 2^WDGTB x (T[5:0] + 1) cycles of 42 MHz.
        assert_eq!(bites_us(&mut running(0, 0x40)), 97);
        assert_eq!(bites_us(&mut running(0, 0x7f)), 6_241);
        assert_eq!(bites_us(&mut running(3, 0x7f)), 49_932);
    }

    #[test]
    fn its_ticks_go_on_through_each_feeding() {
        let mut part = running(0, 0x4a);
        // In the middle of the third tick: eleven more begin with its end.
        assert_eq!(part.write(VirtualNanos(250_000), WWDG.base, Width::W32, 0xca), Ok(()));
        let (watchdog, _) = part.pair();
        assert_eq!(watchdog.bites().expect("it runs").0 / 1_000, 97_523 * 13 / 1_000);
    }
}
