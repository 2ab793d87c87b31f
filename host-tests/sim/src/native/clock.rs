//! Virtual time, exact: whole femtoseconds from the scene's start.

/// Femtoseconds in a second.
const FS: f64 = 1e15;

/// An instant; below 0 while the fingers are tared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock(i128);

impl Clock {
    /// So long before the start.
    pub fn before(seconds: f64) -> Self {
        Self(-whole(seconds))
    }

    /// Goes on by less than an hour.
    pub fn go_on(&mut self, seconds: f64) {
        self.0 += whole(seconds);
    }

    /// From the scene's start.
    pub fn time_s(self) -> f64 {
        self.0 as f64 / FS
    }
}

fn whole(seconds: f64) -> i128 {
    (seconds * FS + 0.5) as i128
}
