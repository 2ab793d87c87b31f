//! Motions that measure: the chip moves safely and records, a host solves.
//!
//! | task | motion | record |
//! | --- | --- | --- |
//! | jog | pulses of voltage in the air, 0.8 mm forward and back | none: it proves that motor and encoder go the same way |
//! | strokes | the jog to both sides, then strokes at several speeds in the air | a [`Row::Sample`] every 8 frames |
//! | press | into a flat plate and back at two speeds, and a hold | a [`Row::Step`] for every step of the travel |
//!
//! Nothing is fitted and nothing is judged here but whether to go on: each motion has limits of travel, force, speed and
//! time, beside those of guard and monitor. [`crate::capture`] keeps the rows in the memory of a capture, and a host
//! reads them the same way; [`series`] has the layout. `docs/solve.md` describes what a host computes from them.

pub mod press;
pub mod series;
pub mod strokes;

pub use press::Press;
pub use strokes::Strokes;

use crate::units::Newtons;
use press::Step;

/// What is asked for. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Task {
    /// To stop what is under way.
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
    /// The task in the number of a request: its two lowest bits.
    pub const fn of(request: u8) -> Self {
        match request & 3 {
            1 => Self::Jog,
            2 => Self::Strokes,
            3 => Self::Press,
            _ => Self::Stop,
        }
    }

    /// The number that asks for this task after another request.
    pub const fn after(self, request: u8) -> u8 {
        (request & !3).wrapping_add(4) | self as u8
    }
}

/// How a motion ended. The numbers are stable. What [`Standing::value`] means is in brackets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Ended {
    /// It was completed, or has not ended.
    #[default]
    Complete = 0,
    /// Stop, torque, a fault, a tare or new parameters ended it.
    Interrupted = 1,
    /// A tare is missing, something touches the tip, torque is not as the task needs it, or a count is above 0.1 mm.
    NotReady = 2,
    /// The direction is not confirmed.
    Unconfirmed = 3,
    /// The encoder did not count up to this voltage (mV).
    Still = 4,
    /// The encoder counts against the voltage (counts).
    Reversed = 5,
    /// The tip left the way of the strokes (um).
    Astray = 6,
    /// The array measured a touch, or in a press more than the largest goal (mN).
    Touched = 7,
    /// The motor felt a force that the array did not (mN).
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

impl Ended {
    /// The end of this number.
    pub fn of(number: u8) -> Option<Self> {
        let all = [
            Self::Complete,
            Self::Interrupted,
            Self::NotReady,
            Self::Unconfirmed,
            Self::Still,
            Self::Reversed,
            Self::Astray,
            Self::Touched,
            Self::Pushed,
            Self::Restless,
            Self::NoContact,
            Self::Stalled,
            Self::Full,
        ];
        all.into_iter().find(|ended| *ended as u8 == number)
    }
}

/// State of the motion that was last requested.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// What it is doing.
    pub state: State,
    /// The task.
    pub task: Task,
    /// How it ended.
    pub ended: Ended,
    /// The number behind that.
    pub value: i32,
    /// How much of it is done, percent.
    pub progress: u8,
}

/// What a motion is doing. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// None was asked for since reset.
    #[default]
    None = 0,
    /// It is under way.
    Running = 1,
    /// It is complete.
    Done = 2,
    /// It ended early.
    Ended = 3,
}

impl Standing {
    /// A task under way.
    pub const fn running(task: Task) -> Self {
        Self { state: State::Running, task, ended: Ended::Complete, value: 0, progress: 0 }
    }

    /// Ends it, where it is under way.
    pub fn end(&mut self, ended: Ended, value: i32) {
        if self.state == State::Running {
            *self = Self::over(self.task, ended, value);
        }
    }

    /// A task that has ended, or could not begin.
    pub const fn over(task: Task, ended: Ended, value: i32) -> Self {
        let (state, progress) = if matches!(ended, Ended::Complete) { (State::Done, 100) } else { (State::Ended, 0) };
        Self { state, task, ended, value, progress }
    }
}

/// What a frame adds to the record of a motion.
#[derive(Clone, Copy, Debug)]
pub enum Row<'a, const ROWS: usize, const COLUMNS: usize> {
    /// A part of a complete step of a press, of [`press::PARTS`].
    Step(&'a Step<ROWS, COLUMNS>, u8),
    /// A stroke begins with the next frame.
    Stroke,
    /// A sample of a stroke.
    Sample {
        /// The encoder's count, from where the strokes began.
        count: i16,
        /// Mean voltage since the sample before, quarters of a mV.
        voltage: i16,
    },
}

/// A force in mN, as [`Standing::value`] has it.
fn millinewtons(force: Newtons) -> i32 {
    ((i64::from(force.to_bits()) * 1_000) >> 16) as i32
}

impl<const ROWS: usize, const COLUMNS: usize> Row<'_, ROWS, COLUMNS> {
    /// Whether a row of the record begins with it, and whether one ends.
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
