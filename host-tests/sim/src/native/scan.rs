//! A frame, slot by slot, while the world moves on.

use super::Board;
use crate::effects::link::Stages as _;
use crate::effects::set::Set;
use crate::mechanics::contact::Place;
use core::ops::Range;
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};

/// Slots between the end of a frame and the duty that came of it: what the step takes on the microcontroller, rounded
/// up.
pub const DUTY_DELAY_SLOTS: usize = 3;

impl<E: Set> Board<E> {
    /// Scans one frame of each finger while the world moves on.
    pub(super) fn scan(&mut self) {
        let time_s = self.time_s();
        let second_s = self.units[0].link.second_s(time_s);
        let slot_s = self.slot_s * second_s;
        for slot in [0..DUTY_DELAY_SLOTS, DUTY_DELAY_SLOTS..SLOTS] {
            if slot.start == DUTY_DELAY_SLOTS {
                for (bridge, unit) in self.bridges.iter_mut().zip(&self.units) {
                    *bridge = unit.next;
                }
            }
            self.slots(slot, slot_s);
        }
    }

    /// Moves the world through slots under the same duty, and samples each at its end.
    fn slots(&mut self, slots: Range<usize>, slot_s: f64) {
        let at_once = (self.longest_s / slot_s).max(1.0) as usize;
        let parts = (slot_s / self.longest_s).ceil().max(1.0);
        let mut from = slots.start;
        while from < slots.end {
            let count = if parts > 1.0 { 1 } else { at_once.min(slots.end - from) };
            let (begun_s, part_s) = (self.time_s(), slot_s * count as f64 / parts);
            for part in 0..parts as usize {
                self.world.advance(begun_s + part as f64 * part_s, part_s, &self.bridges);
            }
            self.sample(from..from + count, slot_s);
            from += count;
        }
    }

    /// Samples slots that the world's last step went through, each at its end.
    fn sample(&mut self, slots: Range<usize>, slot_s: f64) {
        let begun = self.clock;
        for (finger, unit) in self.units.iter_mut().enumerate() {
            let mut places = [Place::NOWHERE; ROWS];
            for (slot, place) in places.iter_mut().enumerate().take(slots.end).skip(slots.start) {
                let gone = slot + 1 - slots.start;
                let since_s = if gone == slots.len() { f64::INFINITY } else { slot_s * gone as f64 };
                *place = self.world.place(finger, since_s);
            }
            self.clock = begun;
            for slot in slots.clone() {
                self.clock.go_on(slot_s);
                let kpa = places.get(slot).map_or([0.0; COLUMNS], |place| self.world.placed_kpa(finger, place, slot));
                let time_s = self.clock.since(self.start);
                let codes = unit.readout.codes(&mut unit.sensor, slot, time_s, &kpa);
                for (column, code) in codes.into_iter().enumerate() {
                    unit.frame.set_code(slot, column, code);
                }
            }
        }
    }
}

// Virtual time, exact: whole 21sts of a femtosecond from the scene's start, of which the timer's tick (168 MHz) is 125
// million. So any number of ticks is what it is, and no sum is rounded.

/// In a second.
const UNITS: i128 = 21_000_000_000_000_000;

/// An instant of virtual time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock(i128);

impl Clock {
    /// So long after the clock began.
    pub fn from_start(seconds: f64) -> Self {
        Self(seconds.trunc() as i128 * UNITS + units(seconds.fract()))
    }

    /// Goes on.
    pub fn go_on(&mut self, seconds: f64) {
        self.0 += units(seconds);
    }

    /// Goes back.
    pub fn go_back(&mut self, seconds: f64) {
        self.0 -= Self::from_start(seconds).0;
    }

    /// From another instant to this one: below 0 where it is to come.
    pub fn since(self, other: Self) -> f64 {
        let units = self.0 - other.0;
        // The same number either way; the shorter is much quicker, and holds for seven minutes.
        i64::try_from(units).map_or_else(|_| long(units), |units| units as f64) / UNITS as f64
    }

    /// Since the clock began.
    pub fn time_s(self) -> f64 {
        self.since(Self(0))
    }
}

/// Not to be worked out where it is not asked for.
#[cold]
#[inline(never)]
fn long(units: i128) -> f64 {
    units as f64
}

fn units(seconds: f64) -> i128 {
    let units = seconds * UNITS as f64 + 0.5;
    // The same number either way, as above.
    if units.abs() < i64::MAX as f64 { i128::from(units as i64) } else { long_units(units) }
}

/// As [`long`].
#[cold]
#[inline(never)]
fn long_units(units: f64) -> i128 {
    units as i128
}
