//! Captures: a burst of frames kept on the board, which can be replayed to the bit on any machine.
//!
//! A capture is armed, and begins at the next tare: the pipeline is then reset
//! ([`Pipeline::renew`](crate::pipeline::Pipeline::renew)), so that the whole state of the loop is known outside as
//! well. From then on each step's frame, sense, command, duty, mode and fault are kept, with a digest of everything
//! else that the step reported, until the memory is full, the host stops it, or something other than a step acts on
//! the loop. The host reads a capture and feeds its frames through the core again (`tool/replay`).
//!
//! The layout, little-endian; bits fill a byte from its lowest one on:
//!
//! | byte | what |
//! | --- | --- |
//! | 0 | the letters `FTC` and [`VERSION`] |
//! | 4 | rows, columns, why it ended, 0 |
//! | 8 | a number for the names and the order of the parameters |
//! | 12 | frames, bits of all frames, digest after the last one, check sum of the bits, missed frames before the first one |
//! | 32 | numbers of the requests taken up before, as in [`AcknowledgedRequests`]; 0 |
//! | 36 | from frame to frame, ns |
//! | 40 | state of the motor's winding model, as [`Winding`](crate::control::Winding) stores it |
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
use crate::pipeline::{AcknowledgedRequests, Status};
use crate::pressure::Gains;
use crate::state::numbered;
use crate::units::Duty;
use write::{WIDTH_MAX, mix};

/// The version of the layout.
pub const VERSION: u8 = 3;

/// State of a capture. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum CaptureState {
    /// No capture was requested since reset, or it was cancelled.
    #[default]
    None = 0,
    /// The capture begins with the next tare.
    Armed = 1,
    /// Frames are being kept.
    Recording = 2,
    /// The capture can be read.
    Done = 3,
}

numbered! {
    /// Reason why a capture ended. The numbers are stable.
    #[derive(Default)]
    pub enum Ended {
        /// The capture did not end.
        #[default]
        No = 0,
        /// The memory is full.
        Full = 1,
        /// The host stopped it.
        Asked = 2,
        /// Parameters or gains changed.
        Configured = 3,
        /// The firmware stopped the motor between two steps: frames were lost, or a step came too late.
        Stopped = 4,
        /// The firmware shorted the motor at a broken array before its frame was whole.
        Cut = 5,
    }
}

/// Status of a capture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CaptureStatus {
    /// State of the capture.
    pub state: CaptureState,
    /// Reason why the capture ended.
    pub ended: Ended,
    /// Number of captures begun since reset; wraps.
    pub count: u8,
    /// Number of frames kept.
    pub frames: u32,
    /// Number of bytes of the whole capture, once it can be read.
    pub bytes: u32,
}

/// Step relative to which the next frame is written.
#[derive(Clone, Copy, Debug)]
pub struct Last<const ROWS: usize, const COLUMNS: usize> {
    /// Frame of the step.
    pub frame: Frame<ROWS, COLUMNS>,
    /// Measurements beside the frame.
    pub sense: Sense,
    /// Requests of the host.
    pub command: Command,
    /// Duty that the step returned, Q15.
    pub duty: i16,
    /// Number of the mode after the step.
    pub mode: u8,
    /// Number of the fault after the step; 0 without one.
    pub fault: u8,
    /// Sum of the folded differences of the frame's codes: the width of the next frame's codes follows it.
    pub spread: u32,
    /// Digest of all steps so far.
    pub digest: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> Last<ROWS, COLUMNS> {
    /// State before the first frame: all zeros.
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

    /// Number of low bits that a code's folded difference is likely to need.
    pub fn width(&self) -> u32 {
        let codes = (COLUMNS * (ROWS + 1)) as u32;
        let mut width = 0;
        while width < WIDTH_MAX && codes << width < self.spread {
            width += 1;
        }
        width
    }
}

/// Low bits of the values coded beside the codes, chosen by the change of each from frame to frame.
pub mod width {
    /// Width of the frame's number.
    pub const SEQUENCE: u32 = 0;
    /// Width of the encoder's count.
    pub const ENCODER: u32 = 1;
    /// Width of the bridge's supply, mV.
    pub const SUPPLY: u32 = 2;
    /// Width of the time since the bus's last packet, ms.
    pub const SILENT: u32 = 0;
    /// Width of the time from the frame's end to its duty, core cycles.
    pub const ANSWER: u32 = 6;
    /// Width of the microcontroller's temperature.
    pub const CHIP: u32 = 0;
    /// Width of the duty, Q15.
    pub const DUTY: u32 = 6;
}

/// Head of a capture: the state of the loop before its first frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head<const ROWS: usize, const COLUMNS: usize> {
    /// Reason why the capture ended.
    pub ended: Ended,
    /// Number of frames.
    pub frames: u32,
    /// Number of bits of all frames.
    pub bits: u32,
    /// Digest after the last frame.
    pub digest: u32,
    /// Check sum of the frames' bits.
    pub check: u32,
    /// Number of frames missed since reset, before the first one.
    pub missed_frames: u32,
    /// Requests acknowledged before.
    pub taken: AcknowledgedRequests,
    /// Thermal state of the motor's winding, see [`Winding`](crate::control::Winding).
    pub winding: [u32; WINDING_WORDS],
    /// Time from frame to frame, ns.
    pub frame_ns: u32,
    /// The parameters in force.
    pub params: Params,
    /// The gains in force.
    pub gains: Gains<ROWS, COLUMNS>,
}

/// First bytes of a capture.
pub const MAGIC: [u8; 4] = [b'F', b'T', b'C', VERSION];
/// Number of words before those that make the digest's initial value.
const SEEDED_FROM: usize = 7;
/// Number of bytes before the parameters.
const FIXED: usize = 40 + 4 * WINDING_WORDS;

/// Number that identifies the names and the order of the parameters (FNV-1a of 32 bits).
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
    /// Number of bytes of the head.
    pub const BYTES: usize = FIXED + 4 * Params::COUNT + 4 * Gains::<ROWS, COLUMNS>::WORDS;

    /// Initial value of the digest of the steps: the digest of the state before the first one.
    pub fn seed(&self) -> u32 {
        let (mut place, mut seed) = (0, LAYOUT);
        self.words(&mut |word| {
            seed = if place < SEEDED_FROM { seed } else { mix(seed, word) };
            place += 1;
        });
        seed
    }

    fn write(&self, bytes: &mut [u8]) {
        let mut rest = bytes.as_chunks_mut().0.iter_mut();
        self.words(&mut |word| rest.next().into_iter().for_each(|to| *to = word.to_le_bytes()));
    }

    /// Calls `each` with every word of the head, in order.
    #[inline(never)]
    fn words(&self, each: &mut dyn FnMut(u32)) {
        let [magic, shape] = [MAGIC, [ROWS as u8, COLUMNS as u8, self.ended as u8, 0]].map(u32::from_le_bytes);
        let Self { frames, bits, digest, check, missed_frames, taken, frame_ns, .. } = *self;
        let fixed = [magic, shape, LAYOUT, frames, bits, digest, check, missed_frames, taken.word(), frame_ns];
        fixed.iter().chain(&self.winding).for_each(|word| each(*word));
        self.params.to_array().iter().for_each(|value| each(value.cast_unsigned()));
        (0..Gains::<ROWS, COLUMNS>::WORDS).for_each(|word| each(self.gains.word(word)));
    }

    /// Completes a written head with the reason of the end, frames, bits, digest and check sum.
    fn close(bytes: &mut [u8], ended: Ended, words: [u32; 4]) {
        if let Some(place) = bytes.get_mut(6) {
            *place = ended as u8;
        }
        for (place, word) in bytes.get_mut(12..28).unwrap_or_default().as_chunks_mut::<4>().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
    }
}

/// Returns the digest after one more step. A difference in one step changes all later digests.
pub fn digest_step(digest: u32, duty: Duty, status: &Status) -> u32 {
    let mut sum = digest;
    status.words(duty, |word| sum = mix(sum, word));
    sum
}

/// Returns the digest of more words.
pub fn digest_words(digest: u32, words: impl Iterator<Item = u32>) -> u32 {
    words.fold(digest, mix)
}

/// Returns the part of a digest that is kept with each frame: the upper bits, which depend on all others.
pub const fn short_digest(digest: u32) -> u16 {
    (digest >> 16) as u16
}
