//! The time that the loop has, and the fit level that fits it.
//!
//! The core has no clock: whoever calls the step measures how long the last one took. The fit level that was asked for
//! is in use as long as the dearest frame expected at it ends before the deadline, less a margin. It falls by one where
//! that is no longer so, at once; it rises by one where the next fit level is expected to fit after [`WINDOW`] frames,
//! and after a fall only later and later, so that it does not hunt. A fit level that is not expected to fit is not
//! tried.

use crate::contact::FitLevel;
use crate::units::CoreCycles;

/// Frames over which the time is watched before the fit level rises: two refinements at the least fit level, and more.
pub const WINDOW: u32 = 32;
/// Windows to wait at most after a fall: 0.8 s at 10 kHz.
pub const WAIT_MAX: u32 = 256;

/// What is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget<const ROWS: usize, const COLUMNS: usize> {
    fit_level: FitLevel,
    /// What was asked for, and the deadline, when last looked at.
    asked: (FitLevel, u32),
    /// Whether the model was at work in the frame whose time comes next.
    modelled: bool,
    /// The longest time of a frame without the model, ticks.
    without_model: u32,
    /// The longest of this window's frames.
    longest: u32,
    frames: u32,
    /// Windows to let pass before the fit level may rise, and after the next fall.
    wait: u32,
    wait_next: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> Budget<ROWS, COLUMNS> {
    /// Nothing measured yet: the least fit level.
    pub const fn new() -> Self {
        Self {
            fit_level: FitLevel::Sum,
            asked: (FitLevel::Sum, 0),
            modelled: false,
            without_model: 0,
            longest: 0,
            frames: 0,
            wait: 0,
            wait_next: 1,
        }
    }

    /// What the dearest frame takes beyond one by the sums: its most and its least, cycles of the core.
    ///
    /// Estimated cycles on a Cortex-M4F with the flash's waits, all taxels under the contact, rounded up
    /// (`cargo xtask timing`, `docs/study.md`): of 10 x 10 the start of a refinement 2,100 at most, its solution
    /// 1,600, a row 1,000. Of other shapes a row goes by its taxels, and the start by the places along both sides.
    pub const fn model_cycles(fit_level: FitLevel) -> [u32; 2] {
        // A table, worked out by the compiler.
        Self::MODEL_CYCLES[fit_level as usize]
    }

    const MODEL_CYCLES: [[u32; 2]; FitLevel::ALL.len()] = {
        let mut ticks = [[0; 2]; FitLevel::ALL.len()];
        let mut fit_level = 0;
        while fit_level < ticks.len() {
            ticks[fit_level] = Self::ticks(FitLevel::ALL[fit_level]);
            fit_level += 1;
        }
        ticks
    };

    const fn ticks(fit_level: FitLevel) -> [u32; 2] {
        let rows = fit_level.rows(ROWS);
        if rows == 0 {
            return [0, 0];
        }
        let (start, row) = (1_700 + 20 * (ROWS + COLUMNS), 100 * COLUMNS);
        let [solution, more] = if rows == ROWS { [1_600, 300] } else { [0, 0] };
        [(start + rows * row + solution) as u32, (1_300 + rows * row / 5 + more) as u32]
    }

    /// Of a time, what is to be used: an eighth is left for what was never measured.
    pub const fn usable(deadline: u32) -> u32 {
        deadline - deadline / 8
    }

    /// The fit level for the next frame, where the last one took `taken` of its deadline. A time of 0 was not measured:
    /// then it is the fit level asked for.
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

    /// Whether the frame that was just worked on took the model.
    pub fn note(&mut self, modelled: bool) {
        if modelled != self.modelled {
            self.modelled = modelled;
            self.restart();
        }
    }

    fn weigh(&mut self, taken: u32, usable: u32) {
        let [most, least] = Self::model_cycles(self.fit_level);
        let (expected, surely) =
            if self.modelled { (taken, taken.saturating_sub(most)) } else { (taken.saturating_add(most), taken) };
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
        // The dearest frame of a window took at least this for the model.
        self.without_model = if self.modelled { self.longest.saturating_sub(least) } else { self.longest };
        self.restart();
        self.wait = self.wait.saturating_sub(1);
        // A rise needs a little more room than staying, so that what varies by a little does not undo it.
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
