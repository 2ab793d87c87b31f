//! Times that outlast the stopwatch.

use super::super::guard;

const TICKS_PER_MS: u32 = guard::HZ / 1_000;

/// The stopwatch in microseconds, beyond its wrap.
pub struct FrameClock {
    last: u32,
    part_ticks: u32,
    time_us: u32,
}

impl FrameClock {
    /// From 0 on.
    pub const fn new() -> Self {
        Self { last: 0, part_ticks: 0, time_us: 0 }
    }

    /// The time of an instant at most half a wrap of the stopwatch later than the last one. A frame that ended before
    /// its loss was noticed counts as from then.
    pub fn at_us(&mut self, instant: u32) -> u32 {
        let passed = instant.wrapping_sub(self.last);
        if passed.cast_signed() < 0 {
            return self.time_us;
        }
        let ticks = passed + self.part_ticks;
        self.last = instant;
        self.part_ticks = ticks % guard::TICKS_PER_US;
        self.time_us = self.time_us.wrapping_add(ticks / guard::TICKS_PER_US);
        self.time_us
    }
}

/// How long the bus has been silent, measured where a hanging link cannot stop the clock.
pub struct BusClock {
    packets: u32,
    last: u32,
    part_ticks: u32,
    silent_ms: u16,
}

impl BusClock {
    /// Heard just now.
    pub const fn new() -> Self {
        Self { packets: 0, last: 0, part_ticks: 0, silent_ms: 0 }
    }

    /// Milliseconds since the count of packets last changed.
    pub fn silent_ms(&mut self, packets: u32) -> u16 {
        let now = guard::now();
        self.part_ticks += now.wrapping_sub(self.last);
        self.last = now;
        if packets != self.packets {
            self.packets = packets;
            self.part_ticks = 0;
            self.silent_ms = 0;
        }
        while self.part_ticks >= TICKS_PER_MS {
            self.part_ticks -= TICKS_PER_MS;
            self.silent_ms = self.silent_ms.saturating_add(1);
        }
        self.silent_ms
    }
}
