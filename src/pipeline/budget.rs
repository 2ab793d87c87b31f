//! The time of a step, and the fit level that it allows.
//!
//! The core has no clock: the caller of the step measures the time of the last one. The requested fit level is in use
//! as long as the longest frame expected at it ends before the deadline, less a margin. The level falls by one at
//! once when that is no longer so. It rises by one when the next level is expected to fit after [`WINDOW`] frames.
//! After each fall it waits longer, so that it does not hunt. A level that is not expected to fit is not tried.

use crate::contact::FitLevel;
use crate::units::CoreCycles;

/// Number of frames over which the time is observed before the fit level rises. A refinement at the least fit level takes
/// up to 17 frames.
pub const WINDOW: u32 = 32;
/// Largest number of windows to wait after a fall: 0.8 s at 10 kHz.
pub const WAIT_MAX: u32 = 256;

/// Expected times, and the fit level in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget<const ROWS: usize, const COLUMNS: usize> {
    fit_level: FitLevel,
    /// Last requested fit level, and last deadline in cycles.
    asked: (FitLevel, u32),
    /// True if the frame whose time comes next used the model; none if its time is not weighed.
    modelled: Option<bool>,
    /// Longest time of a frame without the model, cycles.
    without_model: u32,
    /// Longest time of this window's frames, cycles.
    longest: u32,
    frames: u32,
    /// Number of windows before the fit level may rise, and that number after the next fall.
    wait: u32,
    wait_next: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> Budget<ROWS, COLUMNS> {
    /// Creates a budget at the least fit level, without a measured time.
    pub const fn new() -> Self {
        Self {
            fit_level: FitLevel::Sum,
            asked: (FitLevel::Sum, 0),
            modelled: Some(false),
            without_model: 0,
            longest: 0,
            frames: 0,
            wait: 0,
            wait_next: 1,
        }
    }

    /// Bounds, upper and lower, of the time that the model adds to the longest frame, cycles of the core.
    ///
    /// Estimated cycles on a Cortex-M4F with the flash's wait states, all taxels under the contact, rounded up
    /// (`docs/study.md`): with 10 x 10 taxels the start of a refinement takes at most 2,100,
    /// its solution 1,600, a row 1,000. A refinement that is spread over frames starts in a separate frame. For other
    /// shapes a row is computed from its taxels, and the start from the sum of both sides.
    pub const fn model_cycles(fit_level: FitLevel) -> [u32; 2] {
        // A table that the compiler computes.
        Self::MODEL_CYCLES[fit_level as usize]
    }

    const MODEL_CYCLES: [[u32; 2]; FitLevel::ALL.len()] = {
        let mut cycles = [[0; 2]; FitLevel::ALL.len()];
        let mut fit_level = 0;
        while fit_level < cycles.len() {
            cycles[fit_level] = Self::cycles(FitLevel::ALL[fit_level]);
            fit_level += 1;
        }
        cycles
    };

    const fn cycles(fit_level: FitLevel) -> [u32; 2] {
        let rows = fit_level.rows(ROWS);
        if rows == 0 {
            return [0, 0];
        }
        let (start, taken) = (1_700 + 20 * (ROWS + COLUMNS), 100 * COLUMNS * rows);
        let solved = taken + 1_600;
        if rows == ROWS {
            [(start + solved) as u32, (1_600 + taken / 5) as u32]
        } else if start > solved {
            [start as u32, (1_300 + taken / 5) as u32]
        } else {
            [solved as u32, (1_300 + taken / 5) as u32]
        }
    }

    /// Part of a deadline that may be used: an eighth is left for what was never measured.
    pub const fn usable(deadline: u32) -> u32 {
        deadline - deadline / 8
    }

    /// Returns the fit level for the next frame, from the time that the last one took. A time of 0 was not measured:
    /// then the requested level is used.
    pub fn next(&mut self, asked: FitLevel, taken: CoreCycles, deadline: CoreCycles) -> FitLevel {
        let (CoreCycles(taken), CoreCycles(deadline)) = (taken, deadline);
        if self.asked != (asked, deadline) {
            self.asked = (asked, deadline);
            (self.wait, self.wait_next) = (0, 1);
        }
        if taken == 0 || asked <= self.fit_level {
            self.set(asked);
        }
        if taken != 0 {
            self.weigh(taken, Self::usable(deadline));
        }
        self.fit_level
    }

    /// Takes note if the present frame used the model; none for a frame whose time shows nothing about those in which
    /// the model may be used.
    pub fn note(&mut self, modelled: Option<bool>) {
        if modelled != self.modelled {
            self.modelled = modelled;
            self.restart();
        }
    }

    fn weigh(&mut self, taken: u32, usable: u32) {
        let Some(modelled) = self.modelled else { return };
        let [most, least] = Self::model_cycles(self.fit_level);
        let (expected, surely) =
            if modelled { (taken, taken.saturating_sub(most)) } else { (taken.saturating_add(most), taken) };
        self.without_model = self.without_model.max(surely);
        if expected > usable && self.fit_level > FitLevel::Sum {
            self.wait = self.wait_next;
            self.wait_next = (2 * self.wait_next).min(WAIT_MAX);
            return self.set(self.fit_level.lower());
        }
        self.longest = self.longest.max(taken);
        self.frames += 1;
        if self.frames < WINDOW {
            return;
        }
        // The longest frame of a window took at least this for the model.
        self.without_model = if modelled { self.longest.saturating_sub(least) } else { self.longest };
        self.restart();
        self.wait = self.wait.saturating_sub(1);
        // A rise needs slightly more time than staying, so that a small variation does not undo it.
        let higher = self.fit_level.higher();
        let [most, _] = Self::model_cycles(higher);
        if self.wait == 0
            && self.fit_level < self.asked.0
            && self.without_model.saturating_add(most) <= usable - usable / 32
        {
            self.set(higher);
        }
    }

    fn set(&mut self, fit_level: FitLevel) {
        if fit_level != self.fit_level {
            self.fit_level = fit_level;
            self.restart();
        }
    }

    fn restart(&mut self) {
        (self.longest, self.frames) = (0, 0);
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Budget<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::new()
    }
}
