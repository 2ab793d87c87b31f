//! The true time between two samples.

use fingertip::shipped::ROWS;

/// When each row was sampled last.
#[derive(Clone, Debug, Default)]
pub struct Since([Option<f64>; ROWS]);

impl Since {
    /// The time since the row's sample before; 0 at its first.
    pub fn step_s(&mut self, row: usize, time_s: f64) -> f64 {
        self.0[row].replace(time_s).map_or(0.0, |before| (time_s - before).max(0.0))
    }
}
