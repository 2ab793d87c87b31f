//! Captures on the host: reads their bytes ([`fingertip::capture`] has the layout), and feeds the frames through the core
//! again, whose answers must be the same to the bit.

#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

pub mod file;

use fingertip::capture::{
    ESCAPE, Ended, Head, LAYOUT, Last, MAGIC, VERSION, digest_step, digest_words, short_digest, width,
};
use fingertip::command::Command;
use fingertip::config::{ConfigError, Shaped};
use fingertip::contact::FitLevel;
use fingertip::control::{self, Winding};
use fingertip::frame::{Frame, Sense};
use fingertip::params::Params;
use fingertip::pipeline::{self, Pipeline, Status};
use fingertip::pressure::{Calibration, Gains};
use fingertip::scan::Clocks;
use fingertip::units::{Celsius, CoreCycles, Duty, Newtons};
use std::cmp::Ordering;

/// A capture that was fed through the core again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Replayed<const ROWS: usize, const COLUMNS: usize> {
    pub head: Head<ROWS, COLUMNS>,
    pub difference: Option<Difference>,
}

/// First difference between a replay and its capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The frame, from 0.
    pub frame: u32,
    /// `duty` (Q15), `mode`, `fault`, or `digest`: that of the whole status.
    pub field: &'static str,
    pub captured: i64,
    pub replayed: i64,
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { frame, field, captured, replayed } = self;
        write!(f, "differs first at frame {frame}: {field} captured {captured}, replayed {replayed}")
    }
}

/// Replays a capture and continues after a difference. `each` gets every frame with the status of the core here.
pub fn replay<const ROWS: usize, const COLUMNS: usize>(
    bytes: &[u8],
    clocks: &Clocks,
    mut each: impl FnMut(&CapturedFrame<ROWS, COLUMNS>, &Status),
) -> Result<Replayed<ROWS, COLUMNS>, ReplayError> {
    let (head, frames) = frames::<ROWS, COLUMNS>(bytes)?;
    let config = Shaped::new(&head.params, clocks).map_err(ReplayError::Config)?;
    let (captured, here) = (head.frame_ns, config.timing.frame_ns);
    if captured != here {
        return Err(ReplayError::FrameTime { captured, here });
    }
    let mut pipeline = Pipeline::new(&config);
    pipeline.calibrate(&Calibration::of(&head.gains));
    let winding = Winding::of_words(&head.winding, &config).ok_or(ReplayError::Damaged)?;
    pipeline.renew(head.taken, head.missed_frames, winding);
    let (mut difference, mut running) = (None, head.seed());
    for (frame, taken) in (0..).zip(frames) {
        let taken = taken?;
        let (duty, status) = pipeline.step(&taken.frame, &taken.sense, &taken.command);
        running = digest_step(running, duty, status);
        let fields = [
            ("duty", i64::from(taken.duty.0), i64::from(duty.0)),
            ("mode", taken.mode.into(), status.mode as i64),
            ("fault", taken.fault.into(), status.fault.map_or(0, |fault| fault as i64)),
            ("digest", taken.digest.into(), short_digest(running).into()),
        ];
        let first = fields.into_iter().find(|(_, captured, replayed)| captured != replayed);
        difference =
            difference.or(first.map(|(field, captured, replayed)| Difference { frame, field, captured, replayed }));
        each(&taken, status);
    }
    let running = digest_words(running, std::iter::once(head.ended as u32));
    if running != head.digest && difference.is_none() {
        let frame = head.frames.saturating_sub(1);
        let [captured, replayed] = [head.digest, running].map(i64::from);
        difference = Some(Difference { frame, field: "digest", captured, replayed });
    }
    Ok(Replayed { head, difference })
}

/// Reason why bytes cannot be replayed as a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    #[error("no capture: it does not begin as one")]
    NoCapture,
    #[error("a capture of layout {0}; this firmware's is layout {VERSION}")]
    Version(u8),
    #[error("a capture of {rows} x {columns} taxels, which this is not built for")]
    Shape { rows: u8, columns: u8 },
    #[error("a capture of a firmware with other parameters than these {}: replay it with that version", Params::COUNT)]
    Layout,
    #[error("the capture was not ended on the board")]
    Unfinished,
    #[error("the capture is cut off")]
    Cut,
    #[error("the capture is longer than it says")]
    Longer,
    #[error("the capture is damaged: it is not as the board wrote it")]
    Damaged,
    #[error("the capture's parameters make no configuration: {0}")]
    Config(ConfigError),
    #[error("captured with a frame each {captured} ns; by its parameters it is {here} ns here")]
    FrameTime { captured: u32, here: u32 },
    /// Number, from 0, of a frame whose bits are invalid.
    #[error("the capture is damaged: frame {0} makes no sense")]
    Frame(u32),
}

/// A captured frame, and the answer of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CapturedFrame<const ROWS: usize, const COLUMNS: usize> {
    pub frame: Frame<ROWS, COLUMNS>,
    /// Sensed values other than the frame.
    pub sense: Sense,
    pub command: Command,
    pub duty: Duty,
    /// The mode after it, by its number.
    pub mode: u8,
    pub fault: u8,
    /// The upper half of the digest of all that the steps so far reported.
    pub digest: u16,
}

/// The head of a capture, and its frames: after one that makes no sense there are no more.
type Read<Frames, const ROWS: usize, const COLUMNS: usize> = Result<(Head<ROWS, COLUMNS>, Frames), ReplayError>;

/// Reads a capture.
pub fn frames<const ROWS: usize, const COLUMNS: usize>(
    bytes: &[u8],
) -> Read<impl Iterator<Item = Result<CapturedFrame<ROWS, COLUMNS>, ReplayError>>, ROWS, COLUMNS> {
    let head = read_head(bytes)?;
    let body = bytes.get(Head::<ROWS, COLUMNS>::BYTES..).ok_or(ReplayError::Cut)?;
    let need = head.bits.div_ceil(8) as usize;
    match body.len().cmp(&need) {
        Ordering::Less => return Err(ReplayError::Cut),
        Ordering::Greater => return Err(ReplayError::Longer),
        Ordering::Equal if check(body, head.bits) != head.check => return Err(ReplayError::Damaged),
        Ordering::Equal => {}
    }
    let (mut bits, mut last) = (Reader { bytes: body, at: 0, end: head.bits }, Last::NONE);
    let mut sound = true;
    let frames = (0..head.frames).map_while(move |number| {
        let taken = sound.then(|| take(&mut bits, &mut last))?;
        let all = number + 1 < head.frames || bits.at == bits.end;
        sound = taken.is_some() && all;
        Some(taken.filter(|_| all).ok_or(ReplayError::Frame(number)))
    });
    Ok((head, frames))
}

fn take<const ROWS: usize, const COLUMNS: usize>(
    bits: &mut Reader<'_>,
    last: &mut Last<ROWS, COLUMNS>,
) -> Option<CapturedFrame<ROWS, COLUMNS>> {
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
        *code = code.wrapping_add(unfold(folded) as u16);
    }
    *last = Last { frame, sense, command, duty, spread, ..*last };
    Some(CapturedFrame { frame, sense, command, duty: Duty(duty), mode: last.mode, fault: last.fault, digest })
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
        chip: if bits.get(1)? == 1 {
            let before = last.chip.unwrap_or_default().to_bits();
            Some(Celsius::from_bits(before.wrapping_add(bits.signed(width::CHIP)?)))
        } else {
            None
        },
    })
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

fn read_head<const ROWS: usize, const COLUMNS: usize>(bytes: &[u8]) -> Result<Head<ROWS, COLUMNS>, ReplayError> {
    let mut words = bytes.as_chunks::<4>().0.iter();
    let mut next = || words.next().copied().ok_or(ReplayError::Cut);
    let magic = next()?;
    if magic[..3] != MAGIC[..3] {
        return Err(ReplayError::NoCapture);
    }
    if magic != MAGIC {
        return Err(ReplayError::Version(magic[3]));
    }
    let [rows, columns, ended, zero] = next()?;
    if [usize::from(rows), usize::from(columns)] != [ROWS, COLUMNS] {
        return Err(ReplayError::Shape { rows, columns });
    }
    let mut word = || next().map(u32::from_le_bytes);
    if word()? != LAYOUT {
        return Err(ReplayError::Layout);
    }
    let ended = Ended::of(ended).filter(|&ended| ended != Ended::No).ok_or(ReplayError::Unfinished)?;
    let [frames, bits, digest, check, missed_frames] = [word()?, word()?, word()?, word()?, word()?];
    let taken = pipeline::AcknowledgedRequests::from_word(word()?).filter(|_| zero == 0);
    let taken = taken.ok_or(ReplayError::Damaged)?;
    let frame_ns = word()?;
    let mut winding = [0; control::WINDING_WORDS];
    for part in &mut winding {
        *part = word()?;
    }
    let mut values = [0; Params::COUNT];
    for value in &mut values {
        *value = word()?.cast_signed();
    }
    let mut gains = Gains::ONE;
    for place in 0..Gains::<ROWS, COLUMNS>::WORDS {
        if !gains.set_word(place, word()?) {
            return Err(ReplayError::Damaged);
        }
    }
    let params = Params::from_array(&values);
    Ok(Head { ended, frames, bits, digest, check, missed_frames, taken, winding, frame_ns, params, gains })
}

// Reads bits, and the numbers that a capture folds into them.

#[derive(Clone, Debug)]
struct Reader<'a> {
    bytes: &'a [u8],
    at: u32,
    end: u32,
}

impl Reader<'_> {
    /// Reads a number of `count` bits, at most 32; `None` if they are not there.
    fn get(&mut self, count: u32) -> Option<u32> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.end)?;
        let mut value = 0;
        for (place, bit) in (self.at..end).enumerate() {
            let byte = self.bytes.get((bit / 8) as usize)?;
            value |= u32::from(byte >> (bit % 8) & 1) << place;
        }
        self.at = end;
        Some(value)
    }

    /// A folded number of at most `all` bits.
    fn folded(&mut self, width: u32, all: u32) -> Option<u32> {
        let mut ones = 0;
        while ones < ESCAPE && self.get(1)? == 1 {
            ones += 1;
        }
        if ones == ESCAPE { self.get(all) } else { Some(ones << width | self.get(width)?) }
    }

    fn signed(&mut self, width: u32) -> Option<i32> {
        self.folded(width, 32).map(unfold)
    }
}

/// The check sum over all words of the frames' bits, the last one filled up with zeros.
fn check(bytes: &[u8], bits: u32) -> u32 {
    let byte = |place: u32| u32::from(bytes.get(place as usize).copied().unwrap_or(0));
    let word = |place: u32| (0..4).fold(0, |word, part| word | byte(4 * place + part) << (8 * part));
    digest_words(0, (0..=bits / 32).map(word))
}

/// Undoes the folding of a difference.
fn unfold(folded: u32) -> i32 {
    (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed()
}
