//! Virtual time, exact: whole femtoseconds from the scene's start.

/// Femtoseconds in a second.
const FS: f64 = 1e15;

/// An instant of virtual time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock(i128);

impl Clock {
    /// So long after the clock began.
    pub fn from_start(seconds: f64) -> Self {
        Self(whole(seconds))
    }

    /// Goes on.
    pub fn go_on(&mut self, seconds: f64) {
        self.0 += whole(seconds);
    }

    /// From another instant to this one: below 0 where it is to come.
    pub fn since(self, other: Self) -> f64 {
        let fs = self.0 - other.0;
        // The same number either way; the shorter is much quicker, and holds for two and a half hours.
        i64::try_from(fs).map_or_else(|_| long(fs), |fs| fs as f64) / FS
    }

    /// Since the clock began.
    pub fn time_s(self) -> f64 {
        self.since(Self(0))
    }
}

/// Not to be worked out where it is not asked for.
#[cold]
#[inline(never)]
fn long(fs: i128) -> f64 {
    fs as f64
}

fn whole(seconds: f64) -> i128 {
    (seconds * FS + 0.5) as i128
}
