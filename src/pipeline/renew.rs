//! A pipeline as it is after a start, in place.

use crate::control::winding::Winding;

use super::{Budget, Fit, Goal, Guard, Monitor, Pipeline, Press, Run, Scale, SpeedLoop, Status, Taken};

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// Makes all anew but the configuration and the taxels' gains: mode off, not tared, nothing measured. Requests with
    /// these numbers count as taken up, and so many frames as missed before. The motor stays as warm as it is told.
    pub fn renew(&mut self, taken: Taken, missed_frames: u32, winding: Winding) {
        self.array.renew();
        self.budget = Budget::new();
        self.fit = Fit::default();
        self.motion = SpeedLoop { winding, ..SpeedLoop::new() };
        self.monitor = Monitor::default();
        self.guard = Guard::default();
        self.goal = Goal::default();
        self.press = Press::new();
        self.commission = Run::new();
        self.scale = Scale::new();
        self.calibrator.renew();
        self.status = Status { taken, missed_frames, ..Status::default() };
        self.tared = false;
    }

    /// How warm the motor's winding is, and all that this follows from.
    pub fn winding(&self) -> &Winding {
        &self.motion.winding
    }
}
