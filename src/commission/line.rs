//! A straight line through an encoder's counts, one a frame.

use crate::config::motions::COUNTS_MAX;

/// Sums over frames 0 to n - 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Line {
    frames: u32,
    counts: i64,
    moments: i64,
}

/// A fitted line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fitted {
    /// Counts a frame, Q16.
    pub speed: i32,
    /// Frames before the first one at which the line crosses 0, Q8.
    pub zero: i32,
}

/// So many frames at most: the sums then have 43 bits, and the slope's numerator 62.
const FRAMES_MAX: u32 = 2_047;

impl Line {
    /// No frames.
    pub const NONE: Self = Self { frames: 0, counts: 0, moments: 0 };

    /// Takes the count of the next frame.
    pub fn add(&mut self, count: i32) {
        let count = i64::from(count.max(-COUNTS_MAX).min(COUNTS_MAX));
        if self.full() {
            return;
        }
        self.counts += count;
        self.moments += count * i64::from(self.frames);
        self.frames += 1;
    }

    /// Whether it takes no more.
    pub fn full(&self) -> bool {
        self.frames >= FRAMES_MAX
    }

    /// How many frames it has.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The least squares' line; none where it does not rise.
    pub fn fit(&self) -> Option<Fitted> {
        let n = i64::from(self.frames);
        // With times from the middle, 2 i - (n - 1), whose squares sum to n (n^2 - 1) / 3.
        let moment = 2 * self.moments - (n - 1) * self.counts;
        let speed = ((6 * moment) << 16).checked_div(n * (n * n - 1))?;
        let speed = i32::try_from(speed).ok().filter(|speed| *speed > 0)?;
        // Where it is in the middle, over the slope.
        let way = (self.counts << 24).checked_div(n)?;
        let since = way.checked_div(speed.into())?;
        let zero = i32::try_from(since - ((n - 1) << 7)).ok()?;
        Some(Fitted { speed, zero })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_its_ends_hold() {
        let mut line = Line::default();
        assert_eq!(line.fit(), None);
        (0..100).for_each(|frame| line.add(40 + 3 * frame));
        let fitted = line.fit().expect("it rises");
        assert_eq!((fitted.speed, fitted.zero), (3 << 16, (40 << 8) / 3));
        let mut steep = Line::default();
        (0..3_000_i32).for_each(|frame| steep.add(frame.saturating_mul(2_000_000)));
        assert!(steep.full() && steep.frames() == FRAMES_MAX);
        steep.fit();
        let mut falls = Line::default();
        (0..10).for_each(|frame| falls.add(-frame));
        assert_eq!(falls.fit(), None);
    }
}
