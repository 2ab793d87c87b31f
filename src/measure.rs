//! Motions that measure: the chip moves safely and records, a host solves.
//!
//! | task | motion | record |
//! | --- | --- | --- |
//! | jog | pulses of voltage in the air, 0.8 mm forward and back | none: it proves that motor and encoder go the same way |
//! | strokes | the jog to both sides, then strokes at several speeds in the air | a [`Row::Sample`] every 8 frames |
//! | press | into a flat plate and back at two speeds, and a hold | a [`Row::Step`] for every step of the travel |
//!
//! The chip fits nothing, and judges only if a motion may continue: each motion has limits of travel, force, speed
//! and time, besides those of guard and monitor. [`crate::capture`] keeps the rows in the memory of a capture, and a
//! host reads them in the same way; [`series`] has the layout. `docs/solve.md` describes what a host computes from
//! them. A product that never measures builds the library without its feature `measure`.

pub mod press;
pub mod series;
pub mod strokes;

pub use press::Press;
pub use strokes::Strokes;

use crate::state::numbered;
use crate::units::Newtons;
use press::Step;

/// Proof that the library was built with the feature `measure`. Every motion holds this proof. Without the feature
/// there is no such value: no motion can begin, and the compiler leaves the code of all of them out.
#[derive(Clone, Copy, Debug)]
pub struct BuiltIn(#[cfg(not(feature = "measure"))] core::convert::Infallible);

impl BuiltIn {
    /// The proof, if there is one.
    pub const PROOF: Option<Self> = {
        #[cfg(feature = "measure")]
        let proof = Some(Self());
        #[cfg(not(feature = "measure"))]
        let proof = None;
        proof
    };
}

/// Task of a measurement. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Task {
    /// Stop of the motion under way.
    #[default]
    Stop = 0,
    /// The jog, which proves the direction; torque must be off.
    Jog = 1,
    /// The strokes that measure the drive; torque must be off.
    Strokes = 2,
    /// The press that measures tip and array; torque must be on.
    Press = 3,
}

impl Task {
    /// Returns the task in the number of a request: its two lowest bits.
    pub const fn of(request: u8) -> Self {
        match request & 3 {
            1 => Self::Jog,
            2 => Self::Strokes,
            3 => Self::Press,
            _ => Self::Stop,
        }
    }

    /// Returns the number that requests this task after another request.
    pub const fn after(self, request: u8) -> u8 {
        (request & !3).wrapping_add(4) | self as u8
    }
}

numbered! {
    /// End of a motion. The numbers are stable. The meaning of [`MeasureStatus::value`] is in brackets.
    #[derive(Default)]
    pub enum Ended {
        /// The motion was completed, or has not ended.
        #[default]
        Complete = 0,
        /// A stop, torque, a fault, a tare or new parameters ended the motion.
        Interrupted = 1,
        /// A tare is missing, something touches the tip, torque is not as the task needs it, an encoder count is above
        /// 0.1 mm, or the library was built without its feature `measure`.
        NotReady = 2,
        /// The direction is not confirmed.
        Unconfirmed = 3,
        /// The encoder did not count up to this voltage (mV).
        Still = 4,
        /// The encoder counts against the voltage (counts).
        Reversed = 5,
        /// The tip left the range of the strokes (um).
        Astray = 6,
        /// The array measured a touch, in a press more than the largest goal, or a contact that followed the tip back (mN).
        Touched = 7,
        /// The motor measured a force that the array did not (mN).
        Pushed = 8,
        /// The tip did not come to rest (counts in the last half of the time).
        Restless = 10,
        /// The travel ended without a contact (um).
        NoContact = 11,
        /// The tip did not move on for a second (um of travel).
        Stalled = 12,
        /// The memory is full (rows).
        Full = 13,
    }
}

/// Progress of the motion that was last requested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeasureStatus {
    /// State of the motion.
    pub state: MeasureState,
    /// Task of the motion.
    pub task: Task,
    /// End of the motion.
    pub ended: Ended,
    /// Number that explains the end.
    pub value: i32,
    /// Completed part of the motion, percent.
    pub progress: u8,
}

/// State of a motion. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum MeasureState {
    /// No motion was requested since reset.
    #[default]
    None = 0,
    /// The motion is under way.
    Running = 1,
    /// The motion is complete.
    Done = 2,
    /// The motion ended early.
    Ended = 3,
}

impl MeasureStatus {
    /// Progress of a task that begins.
    pub const fn running(task: Task) -> Self {
        Self { state: MeasureState::Running, task, ended: Ended::Complete, value: 0, progress: 0 }
    }

    /// Ends the motion if it is under way.
    pub fn end(&mut self, ended: Ended, value: i32) {
        if self.state == MeasureState::Running {
            *self = Self::over(self.task, ended, value);
        }
    }

    /// Progress of a task that has ended, or could not begin.
    pub const fn over(task: Task, ended: Ended, value: i32) -> Self {
        let (state, progress) =
            if matches!(ended, Ended::Complete) { (MeasureState::Done, 100) } else { (MeasureState::Ended, 0) };
        Self { state, task, ended, value, progress }
    }
}

/// Row that a frame adds to the record of a motion.
#[derive(Clone, Copy, Debug)]
pub enum Row<'a, const ROWS: usize, const COLUMNS: usize> {
    /// A part of a complete step of a press, of [`press::PARTS`].
    Step(&'a Step<ROWS, COLUMNS>, u8),
    /// A stroke begins with the next frame.
    Stroke,
    /// A sample of a stroke.
    Sample {
        /// Encoder count relative to the start of the strokes.
        count: i16,
        /// Mean voltage since the sample before, quarters of a mV.
        voltage: i16,
    },
}

/// Converts a force to mN, for [`MeasureStatus::value`].
fn millinewtons(force: Newtons) -> i32 {
    ((i64::from(force.to_bits()) * 1_000) >> 16) as i32
}

impl<const ROWS: usize, const COLUMNS: usize> Row<'_, ROWS, COLUMNS> {
    /// Returns two flags: a row of the record begins with this part, and a row ends with it.
    pub const fn ends(&self) -> [bool; 2] {
        match self {
            Self::Step(_, part) => [*part == 0, *part + 1 >= press::PARTS],
            Self::Stroke | Self::Sample { .. } => [true; 2],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_tells_its_task_and_differs_from_the_one_before() {
        let mut request = 0;
        for task in [Task::Jog, Task::Jog, Task::Strokes, Task::Press, Task::Stop].into_iter().cycle().take(300) {
            let next = task.after(request);
            assert_ne!(next, request);
            assert_eq!(Task::of(next), task);
            request = next;
        }
    }
}
