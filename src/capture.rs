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

mod write;

pub use write::{Capture, ESCAPE};

use crate::command::Command;
use crate::control::WINDING_WORDS;
use crate::frame::{Frame, Sense};
use crate::params::Params;
use crate::pipeline::{Status, Taken};
use crate::pressure::Gains;
use crate::units::Duty;
use write::{WIDTH_MAX, mix};

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
        while width < WIDTH_MAX && codes << width < self.spread {
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

/// What a capture begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head<const ROWS: usize, const COLUMNS: usize> {
    /// Why it ended.
    pub ended: Ended,
    /// Frames in it.
    pub frames: u32,
    /// Bits of all its frames.
    pub bits: u32,
    /// The digest after the last one.
    pub digest: u32,
    /// The check sum of its frames' bits.
    pub check: u32,
    /// Frames missed since reset, before the first one.
    pub missed_frames: u32,
    /// Requests taken up before.
    pub taken: Taken,
    /// What is known of the motor's winding, as [`Winding`](crate::control::Winding) tells it.
    pub winding: [u32; WINDING_WORDS],
    /// From frame to frame.
    pub frame_ns: u32,
    /// The parameters in force.
    pub params: Params,
    /// The gains in force.
    pub gains: Gains<ROWS, COLUMNS>,
}

/// First bytes of a capture.
pub const MAGIC: [u8; 4] = [b'F', b'T', b'C', VERSION];
/// Bytes before the parameters.
const FIXED: usize = 40 + 4 * WINDING_WORDS;

/// A number for the names and the order of the parameters (FNV-1a of 32 bits).
pub const LAYOUT: u32 = {
    let (mut hash, mut place) = (0x811C_9DC5_u32, 0);
    while place < Params::COUNT {
        let name = Params::RANGES[place].0.as_bytes();
        let mut at = 0;
        while at <= name.len() {
            let byte = if at < name.len() { name[at] } else { 0 };
            hash = (hash ^ byte as u32).wrapping_mul(0x0100_0193);
            at += 1;
        }
        place += 1;
    }
    hash
};

impl<const ROWS: usize, const COLUMNS: usize> Head<ROWS, COLUMNS> {
    /// Its bytes.
    pub const BYTES: usize = FIXED + 4 * Params::COUNT + 4 * Gains::<ROWS, COLUMNS>::WORDS;

    /// What the digest of the steps goes on from: all that is known before the first one.
    pub fn seed(&self) -> u32 {
        let first = [self.missed_frames, self.taken.word(), self.frame_ns];
        let params = self.params.to_array().map(i32::cast_unsigned);
        let gains = (0..Gains::<ROWS, COLUMNS>::WORDS).map(|word| self.gains.word(word));
        digest_words(LAYOUT, first.into_iter().chain(self.winding).chain(params).chain(gains))
    }

    fn write(&self, bytes: &mut [u8]) {
        let mut rest = bytes;
        let mut put = |word: [u8; 4]| {
            if let Some((place, after)) = core::mem::take(&mut rest).split_first_chunk_mut() {
                *place = word;
                rest = after;
            }
        };
        put(MAGIC);
        put([ROWS as u8, COLUMNS as u8, self.ended as u8, 0]);
        for word in [LAYOUT, self.frames, self.bits, self.digest, self.check, self.missed_frames] {
            put(word.to_le_bytes());
        }
        put(self.taken.word().to_le_bytes());
        put(self.frame_ns.to_le_bytes());
        self.winding.iter().for_each(|word| put(word.to_le_bytes()));
        self.params.to_array().iter().for_each(|value| put(value.to_le_bytes()));
        (0..Gains::<ROWS, COLUMNS>::WORDS).for_each(|word| put(self.gains.word(word).to_le_bytes()));
    }

    /// Says in one that was written why the capture ended, and its frames, bits, digest and check sum.
    fn close(bytes: &mut [u8], ended: Ended, words: [u32; 4]) {
        if let Some(place) = bytes.get_mut(6) {
            *place = ended as u8;
        }
        for (place, word) in bytes.get_mut(12..28).unwrap_or_default().as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
    }
}

/// The digest after one more step. What differs once makes all that follow differ.
pub fn digest_step(digest: u32, duty: Duty, status: &Status) -> u32 {
    let mut sum = digest;
    status.words(duty, |word| sum = mix(sum, word));
    sum
}

/// A digest of words, to begin with or to go on from.
pub fn digest_words(digest: u32, words: impl Iterator<Item = u32>) -> u32 {
    words.fold(digest, mix)
}

/// What of a digest is kept with each frame: the upper bits, which all others reach.
pub const fn short_digest(digest: u32) -> u16 {
    (digest >> 16) as u16
}
