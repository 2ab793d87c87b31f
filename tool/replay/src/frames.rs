//! The frames of a capture, read.

use crate::bits::{self, Reader, unfold};
use crate::head;
use fingertip::capture::{Head, Last, VERSION, width};
use fingertip::command::Command;
use fingertip::config::ConfigError;
use fingertip::contact::FitLevel;
use fingertip::frame::{Frame, Sense};
use fingertip::params::Params;
use fingertip::units::{Celsius, CoreCycles, Duty, Newtons};

/// Why bytes are no capture that this version replays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// They do not begin as a capture does.
    NoCapture,
    /// Another version of the layout.
    Version(u8),
    /// Of an array with other rows and columns.
    Shape {
        /// Its rows.
        rows: u8,
        /// Its columns.
        columns: u8,
    },
    /// Of a firmware with other parameters.
    Layout,
    /// It was not ended on the board.
    Unfinished,
    /// Bytes are missing.
    Cut,
    /// There is more than a capture.
    Longer,
    /// It is not as the board wrote it.
    Damaged,
    /// Parameters that make no configuration.
    Config(ConfigError),
    /// The scan's time by the parameters is another: other clocks.
    FrameTime {
        /// As captured, ns.
        captured: u32,
        /// By the parameters, ns.
        here: u32,
    },
    /// The bits of a frame, counted from 0, make no frame.
    Frame(u32),
}

impl std::fmt::Display for Refusal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoCapture => f.write_str("no capture: it does not begin as one"),
            Self::Version(version) => write!(f, "a capture of layout {version}; this firmware's is layout {VERSION}"),
            Self::Shape { rows, columns } => {
                write!(f, "a capture of {rows} x {columns} taxels, which this is not built for")
            }
            Self::Layout => write!(
                f,
                "a capture of a firmware with other parameters than these {}: replay it with the version that it names",
                Params::COUNT
            ),
            Self::Unfinished => f.write_str("the capture was not ended on the board"),
            Self::Cut => f.write_str("the capture is cut off"),
            Self::Longer => f.write_str("the capture is longer than it says"),
            Self::Damaged => f.write_str("the capture is damaged: it is not as the board wrote it"),
            Self::Config(error) => write!(f, "the capture's parameters make no configuration: {error}"),
            Self::FrameTime { captured, here } => {
                write!(f, "captured with a frame each {captured} ns; by its parameters it is {here} ns here")
            }
            Self::Frame(frame) => write!(f, "the capture is damaged: frame {frame} makes no sense"),
        }
    }
}

impl std::error::Error for Refusal {}

/// A frame as the board took it, and what it answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken<const ROWS: usize, const COLUMNS: usize> {
    /// The frame.
    pub frame: Frame<ROWS, COLUMNS>,
    /// What was sensed beside it.
    pub sense: Sense,
    /// What the host asked for.
    pub command: Command,
    /// The duty that the step answered.
    pub duty: Duty,
    /// The mode after it, by its number.
    pub mode: u8,
    /// The fault, by its number; 0 is none.
    pub fault: u8,
    /// The upper half of the digest of all that the steps so far reported.
    pub digest: u16,
}

/// The frames of a capture, in order.
#[derive(Clone, Debug)]
pub struct Frames<'a, const ROWS: usize, const COLUMNS: usize> {
    bits: Reader<'a>,
    last: Last<ROWS, COLUMNS>,
    read: u32,
    count: u32,
}

impl<'a, const ROWS: usize, const COLUMNS: usize> Frames<'a, ROWS, COLUMNS> {
    /// Of a capture, and its beginning.
    ///
    /// # Errors
    /// The bytes are no capture, or one of another array, layout or version; or the capture is damaged, shorter or longer
    /// than it says.
    pub fn new(bytes: &'a [u8]) -> Result<(Head<ROWS, COLUMNS>, Self), Refusal> {
        let head = head::read(bytes)?;
        let body = bytes.get(Head::<ROWS, COLUMNS>::BYTES..).ok_or(Refusal::Cut)?;
        let need = head.bits.div_ceil(8) as usize;
        if body.len() < need {
            return Err(Refusal::Cut);
        }
        if body.len() > need {
            return Err(Refusal::Longer);
        }
        if bits::check(body, head.bits) != head.check {
            return Err(Refusal::Damaged);
        }
        let frames = Self { bits: Reader::new(body, head.bits), last: Last::NONE, read: 0, count: head.frames };
        Ok((head, frames))
    }

    fn take(&mut self) -> Option<Taken<ROWS, COLUMNS>> {
        let (bits, last) = (&mut self.bits, &mut self.last);
        let step = bits.signed(width::SEQUENCE)?.cast_unsigned().wrapping_add(1);
        let sequence = last.frame.sequence.wrapping_add(step);
        let sense = sense(bits, &last.sense)?;
        let command = command(bits, &last.command)?;
        let duty = i16::try_from(i32::from(last.duty).checked_add(bits.signed(width::DUTY)?)?).ok()?;
        if bits.get(1)? == 1 {
            let both = bits.get(16)?;
            (last.mode, last.fault) = (both as u8, (both >> 8) as u8);
        }
        let digest = bits.get(16)? as u16;
        let (width, mut spread) = (last.width(), 0_u32);
        let mut frame = Frame { sequence, ..last.frame };
        for code in frame.codes.rows.as_flattened_mut().iter_mut().chain(&mut frame.codes.undriven) {
            let folded = bits.folded(width, 16)?;
            spread = spread.wrapping_add(folded);
            *code = unfold(folded, *code);
        }
        *last = Last { frame, sense, command, duty, spread, ..*last };
        Some(Taken { frame, sense, command, duty: Duty(duty), mode: last.mode, fault: last.fault, digest })
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Iterator for Frames<'_, ROWS, COLUMNS> {
    type Item = Result<Taken<ROWS, COLUMNS>, Refusal>;

    /// The next frame; after one that makes no sense there are no more.
    fn next(&mut self) -> Option<Self::Item> {
        if self.read == self.count {
            return None;
        }
        let taken = self.take();
        self.read += 1;
        let over = self.read == self.count && !self.bits.is_empty();
        match taken {
            Some(taken) if !over => Some(Ok(taken)),
            _ => {
                self.count = self.read;
                Some(Err(Refusal::Frame(self.read - 1)))
            }
        }
    }
}

fn sense(bits: &mut Reader<'_>, last: &Sense) -> Option<Sense> {
    let short =
        |bits: &mut Reader<'_>, last: u16, width| u16::try_from(i32::from(last).checked_add(bits.signed(width)?)?).ok();
    Some(Sense {
        encoder: last.encoder.wrapping_add(bits.signed(width::ENCODER)?),
        supply_mv: short(bits, last.supply_mv, width::SUPPLY)?,
        bus_silent_ms: short(bits, last.bus_silent_ms, width::SILENT)?,
        bridge_fault: bits.get(1)? == 1,
        answer: CoreCycles(last.answer.0.wrapping_add(bits.signed(width::ANSWER)?.cast_unsigned())),
        chip: if bits.get(1)? == 1 { Some(chip(bits, last)?) } else { None },
    })
}

fn chip(bits: &mut Reader<'_>, last: &Sense) -> Option<Celsius> {
    Some(Celsius::from_bits(last.chip.unwrap_or_default().to_bits().wrapping_add(bits.signed(width::CHIP)?)))
}

fn command(bits: &mut Reader<'_>, last: &Command) -> Option<Command> {
    if bits.get(1)? == 0 {
        return Some(*last);
    }
    let byte = |bits: &mut Reader<'_>| bits.get(8).map(|byte| byte as u8);
    Some(Command {
        torque: bits.get(1)? == 1,
        tare_forced: bits.get(1)? == 1,
        goal: Newtons::from_bits(bits.get(32)?.cast_signed()),
        bus_watchdog_ms: bits.get(16)? as u16,
        fit_level: FitLevel::from_number(byte(bits)?),
        tare_request: byte(bits)?,
        clear_request: byte(bits)?,
        measure_request: byte(bits)?,
    })
}
