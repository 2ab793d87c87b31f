//! Captures: a burst of frames kept on the board, which replays to the bit on any machine.
//!
//! A capture is armed, and begins at the next tare: the pipeline is then made anew
//! ([`Pipeline::renew`](crate::pipeline::Pipeline::renew)), so that all that the loop knows is known outside as well.
//! From then on each step's frame, sense, command, duty, mode and fault are kept, with a digest of everything else that
//! the step reported, until the memory is full, the host stops it, or something acts on the loop that is no step.
//! The host reads a capture and feeds its frames through the core again (`tool/replay`).
//!
//! The layout, little-endian; bits fill a byte from its lowest one on:
//!
//! | byte | what |
//! | --- | --- |
//! | 0 | the letters `FTC` and [`VERSION`] |
//! | 4 | rows, columns, why it ended, 0 |
//! | 8 | a number for the names and the order of the parameters |
//! | 12 | frames, bits of all frames, digest after the last one, check sum of the bits, missed frames before the first one |
//! | 32 | numbers of the requests taken up before, as in [`Taken`](crate::pipeline::Taken); 0 |
//! | 36 | from frame to frame, ns |
//! | 40 | what is known of the motor's winding, as [`Winding`](crate::control::Winding) tells it |
//! | 68 | the parameters, 4 bytes each; the gains, 2 bytes each, of an odd number another two |
//! | then | the frames, without a gap |
//!
//! The same memory keeps the record of a motion that measures ([`Capture::follow`]); [`crate::measure::series`] has its
//! layout.
//!
//! Of a frame only what changed is written: numbers as bits of their difference to the frame before, codes with a
//! width that follows their noise.

mod bits;
pub mod digest;
mod head;
mod write;

pub use bits::ESCAPE;
pub use head::{Head, LAYOUT, MAGIC};
pub use write::Capture;

use crate::command::Command;
use crate::frame::{Frame, Sense};

/// The version of the layout.
pub const VERSION: u8 = 3;

/// What a capture is doing. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// None was asked for since reset, or it was called off.
    #[default]
    None = 0,
    /// It begins with the next tare.
    Armed = 1,
    /// Frames are being kept.
    Recording = 2,
    /// It can be read.
    Done = 3,
}

/// Why a capture ended. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Ended {
    /// It did not.
    #[default]
    No = 0,
    /// Its memory is full.
    Full = 1,
    /// The host stopped it.
    Asked = 2,
    /// Parameters or gains became others.
    Configured = 3,
    /// The firmware stopped the motor between two steps: frames were lost, or a step came too late.
    Stopped = 4,
    /// The firmware shorted the motor at a broken array before its frame was whole.
    Cut = 5,
}

impl Ended {
    /// The inverse of its number; none where there is no such end.
    pub const fn of(number: u8) -> Option<Self> {
        Some(match number {
            0 => Self::No,
            1 => Self::Full,
            2 => Self::Asked,
            3 => Self::Configured,
            4 => Self::Stopped,
            5 => Self::Cut,
            _ => return None,
        })
    }
}

/// How a capture stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    /// What it is doing.
    pub state: State,
    /// Why it ended.
    pub ended: Ended,
    /// Counts the captures begun since reset; wraps.
    pub count: u8,
    /// Frames kept.
    pub frames: u32,
    /// Bytes of the whole capture, once it can be read.
    pub bytes: u32,
}

/// The step to which the next frame's differences are written.
#[derive(Clone, Copy, Debug)]
pub struct Last<const ROWS: usize, const COLUMNS: usize> {
    /// The step's frame.
    pub frame: Frame<ROWS, COLUMNS>,
    /// What was sensed beside the frame.
    pub sense: Sense,
    /// What the host asked for.
    pub command: Command,
    /// The duty that the step returned, Q15.
    pub duty: i16,
    /// The mode's number after the step.
    pub mode: u8,
    /// The fault's number after the step; 0 without one.
    pub fault: u8,
    /// Sum of the folded differences of the frame's codes: the width of the next frame's codes follows it.
    pub spread: u32,
    /// The digest of all steps so far.
    pub digest: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> Last<ROWS, COLUMNS> {
    /// Before the first frame: all zeros.
    pub const NONE: Self = Self {
        frame: Frame::EMPTY,
        sense: Sense {
            encoder: 0,
            supply_mv: 0,
            bus_silent_ms: 0,
            bridge_fault: false,
            answer: crate::units::CoreCycles(0),
            chip: None,
        },
        command: Command {
            torque: false,
            goal: crate::units::Newtons::ZERO,
            bus_watchdog_ms: 0,
            fit_level: crate::contact::FitLevel::Sum,
            tare_request: 0,
            tare_forced: false,
            clear_request: 0,
            measure_request: 0,
        },
        duty: 0,
        mode: 0,
        fault: 0,
        spread: 0,
        digest: 0,
    };

    /// Low bits that a code's folded difference is likely to need.
    pub fn width(&self) -> u32 {
        let codes = (COLUMNS * (ROWS + 1)) as u32;
        let mut width = 0;
        while width < bits::WIDTH_MAX && codes << width < self.spread {
            width += 1;
        }
        width
    }
}

/// Low bits of what is coded beside the codes: chosen by what each does from frame to frame.
pub mod width {
    /// Of the frame's number.
    pub const SEQUENCE: u32 = 0;
    /// Of the encoder's count.
    pub const ENCODER: u32 = 1;
    /// Of the bridge's supply, mV.
    pub const SUPPLY: u32 = 2;
    /// Of the time since the bus's last packet, ms.
    pub const SILENT: u32 = 0;
    /// Of the time from the frame's end to its duty, core cycles.
    pub const ANSWER: u32 = 6;
    /// Of the microcontroller's temperature.
    pub const CHIP: u32 = 0;
    /// Of the duty, Q15.
    pub const DUTY: u32 = 6;
}
