//! When a timer that runs on has its updates: exact, in whole cycles of its clock, as the crate's own has them.

use serde::{Deserialize, Serialize};

const NS: u128 = 1_000_000_000;

/// The updates of a timer.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Updates {
    hz: u64,
    /// Where cycles are counted from.
    epoch_ns: u64,
    /// The cycle of the last update, or of the start, and from one to the next; none while the timer stands.
    running: Option<(u64, u64)>,
}

impl Updates {
    /// The clock has this rate from an instant on.
    pub fn clock(&mut self, hz: u64, at_ns: u64) {
        *self = Self { hz, epoch_ns: at_ns, running: None };
    }

    /// The timer starts from 0 and has an update every so many cycles.
    pub fn start(&mut self, at_ns: u64, cycles: u64) {
        let since = u128::from(at_ns - self.epoch_ns) * u128::from(self.hz) / NS;
        self.running = Some((since as u64, cycles));
    }

    /// The timer stands.
    pub fn stop(&mut self) {
        self.running = None;
    }

    /// Whether the timer runs.
    pub fn running(&self) -> bool {
        self.running.is_some()
    }

    /// The instants of so many updates to come; none while the timer stands.
    pub fn next_ns(&self, count: usize) -> impl DoubleEndedIterator<Item = u64> + use<> {
        let Self { hz, epoch_ns, running } = *self;
        let (last, cycles) = running.unwrap_or_default();
        let count = if running.is_some() { count as u64 } else { 0 };
        (1..=count).map(move |nth| {
            let cycle = u128::from(last + nth * cycles);
            epoch_ns + (cycle * NS).div_ceil(u128::from(hz.max(1))) as u64
        })
    }

    /// So many updates have passed.
    pub fn pass(&mut self, count: usize) {
        if let Some((last, cycles)) = &mut self.running {
            *last += count as u64 * *cycles;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn updates_are_at_the_first_whole_instant_behind_their_cycle() {
        let mut updates = Updates::default();
        updates.clock(168_000_000, 1_000);
        assert_eq!(updates.next_ns(3).next(), None);
        // 7 cycles are 41.7 ns; the start lies 100 ns, 16.8 cycles, behind the epoch.
        updates.start(1_100, 7);
        assert_eq!(updates.next_ns(3).collect::<Vec<_>>(), [1_137, 1_179, 1_221]);
        updates.pass(2);
        assert_eq!(updates.next_ns(1).collect::<Vec<_>>(), [1_221]);
        updates.stop();
        assert!(!updates.running());
    }

    #[test]
    fn a_day_of_updates_loses_no_cycle() {
        let mut updates = Updates::default();
        updates.clock(168_000_000, 0);
        updates.start(0, 1_524);
        let day: u64 = 86_400 * 168_000_000 / 1_524;
        updates.pass(day as usize - 1);
        assert_eq!(updates.next_ns(1).next(), Some((u128::from(day) * 1_524 * 125).div_ceil(21) as u64));
    }
}
