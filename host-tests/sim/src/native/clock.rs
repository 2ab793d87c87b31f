//! Virtual time, exact: whole 21sts of a femtosecond from the scene's start, of which the timer's tick (168 MHz) is 125
//! million. So any number of ticks is what it is, and no sum is rounded.

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
