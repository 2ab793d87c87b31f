//! The board's side of a capture: frames in, bytes kept.
//!
//! # Numbers that are mostly small
//!
//! A number is folded (0, -1, 1, -2 .. are 0, 1, 2, 3 ..) and written as its part above a width in ones, a zero, and as
//! many low bits as the width (a Rice code). A number that would take [`ESCAPE`] ones or more is written as these ones
//! and all its bits.

use super::{CaptureState, CaptureStatus, Ended, Head, Last, digest_step, digest_words, short_digest, width};
use crate::command::Command;
use crate::frame::{Frame, Sense};
use crate::measure::series::{CHECK, HEAD, Head as Series, Out};
use crate::measure::{self, Task};
use crate::pipeline::{Pipeline, Status};
use crate::pressure::Gains;
use crate::state::Mode;
use crate::units::Duty;

/// A capture, and its memory of at least 1 KiB. Nothing here waits or fails; a call out of turn does nothing.
#[derive(Clone, Debug)]
pub struct Capture<const ROWS: usize, const COLUMNS: usize, const BYTES: usize> {
    standing: CaptureStatus,
    place: Place,
    last: Last<ROWS, COLUMNS>,
    /// Head of the record of a motion while one is kept, and its number of bytes so far.
    series: Series,
    length: usize,
    /// Bytes and check sum of the row under way.
    row: (usize, u32),
    /// True if a motion was under way in the step before.
    ran: bool,
    bytes: [u8; BYTES],
}

impl<const ROWS: usize, const COLUMNS: usize, const BYTES: usize> Capture<ROWS, COLUMNS, BYTES> {
    /// Capture before any request. All its bytes are zero.
    pub const NEW: Self = Self {
        standing: CaptureStatus { state: CaptureState::None, ended: Ended::No, count: 0, frames: 0, bytes: 0 },
        place: Place::START,
        last: Last::NONE,
        series: Series::NONE,
        length: 0,
        row: (0, 0),
        ran: false,
        bytes: [0; BYTES],
    };

    /// Progress of the capture.
    pub fn standing(&self) -> CaptureStatus {
        self.standing
    }

    /// Bytes of the capture once it is done; none before.
    pub fn data(&self) -> &[u8] {
        let bytes = if self.standing.state == CaptureState::Done { self.standing.bytes as usize } else { 0 };
        self.bytes.get(..bytes).unwrap_or_default()
    }

    /// Arms the capture: it begins at the next tare, and drops what was kept before. Has no effect while frames are
    /// being kept.
    pub fn arm(&mut self) {
        if self.standing.state != CaptureState::Recording {
            self.restart(CaptureState::Armed, self.standing.count);
        }
    }

    fn restart(&mut self, state: CaptureState, count: u8) {
        self.standing = CaptureStatus { state, count, ..CaptureStatus::default() };
    }

    /// Returns true if the capture should begin: it is armed, and the next step would begin a tare.
    pub fn is_due(&self, pipeline: &Pipeline<ROWS, COLUMNS>, command: &Command) -> bool {
        let status = pipeline.status();
        self.standing.state == CaptureState::Armed
            && status.mode == Mode::Off
            && command.tare_request != status.taken.tare
            && pipeline.takes_tare(command.tare_forced)
    }

    /// Begins, and resets the pipeline; the next step is the first one kept. That takes as long as a frame. A board
    /// has no gains that cannot be stored: with such gains the capture is cancelled.
    pub fn begin(&mut self, pipeline: &mut Pipeline<ROWS, COLUMNS>) {
        let mut gains = Gains::<ROWS, COLUMNS>::ONE;
        let array = pipeline.array();
        let known = (0..ROWS * COLUMNS).all(|place| gains.set(place, array.gain(place / COLUMNS, place % COLUMNS)));
        if !known || BYTES < Head::<ROWS, COLUMNS>::BYTES {
            self.standing.state = CaptureState::None;
            return;
        }
        let Status { missed_frames, taken, .. } = *pipeline.status();
        let config = pipeline.config();
        let head = Head {
            ended: Ended::No,
            frames: 0,
            bits: 0,
            digest: 0,
            check: 0,
            missed_frames,
            taken,
            winding: pipeline.winding().words(),
            frame_ns: config.timing.frame_ns,
            params: config.params,
            gains,
        };
        head.write(&mut self.bytes);
        let winding = *pipeline.winding();
        pipeline.renew(taken, missed_frames, winding);
        self.place = Place::START;
        self.last = Last { digest: head.seed(), ..Last::NONE };
        self.restart(CaptureState::Recording, self.standing.count.wrapping_add(1));
    }

    /// Keeps the inputs and the results of a step.
    pub fn record(&mut self, frame: &Frame<ROWS, COLUMNS>, sense: &Sense, command: &Command, status: &Status) {
        if self.standing.state != CaptureState::Recording || self.series.kind != 0 {
            return;
        }
        let body = self.bytes.get_mut(Head::<ROWS, COLUMNS>::BYTES..).unwrap_or_default();
        // The last word is for the rest of less than a word.
        let room = body.len().saturating_sub(4);
        let mut out = Writer::new(body.get_mut(..room).unwrap_or_default(), self.place);
        let last = &mut self.last;
        out.signed(frame.sequence.wrapping_sub(last.frame.sequence).wrapping_sub(1).cast_signed(), width::SEQUENCE);
        put_sense(&mut out, sense, &last.sense);
        put_command(&mut out, command, &last.command);
        let duty = status.duty.0;
        out.signed(i32::from(duty) - i32::from(last.duty), width::DUTY);
        let (mode, fault) = (status.mode as u8, status.fault.map_or(0, |fault| fault as u8));
        if (mode, fault) == (last.mode, last.fault) {
            out.put(0, 1);
        } else {
            out.put(1 | u32::from(mode) << 1 | u32::from(fault) << 9, 17);
        }
        let digest = digest_step(last.digest, Duty(duty), status);
        out.put(short_digest(digest).into(), 16);
        let (width, codes, before) = (last.width(), &frame.codes, &last.frame.codes);
        let spread = out.codes(codes.rows.as_flattened(), before.rows.as_flattened(), width);
        let spread = spread.wrapping_add(out.codes(&codes.undriven, &before.undriven, width));
        let (place, full) = (out.place, out.full);
        if full {
            return self.end(Ended::Full);
        }
        self.place = place;
        self.standing.frames += 1;
        self.last = Last { frame: *frame, sense: *sense, command: *command, duty, mode, fault, spread, digest };
    }

    /// Keeps the row that a step adds to the record of a motion that measures. The record replaces an earlier
    /// capture, begins and ends with the motion, and has no effect while frames are being kept.
    pub fn follow(&mut self, pipeline: &Pipeline<ROWS, COLUMNS>) {
        let motion = pipeline.status().measure;
        let runs = motion.state == measure::MeasureState::Running;
        let ran = core::mem::replace(&mut self.ran, runs);
        if runs && !ran && motion.task != Task::Jog && self.standing.state != CaptureState::Recording {
            let press = motion.task == Task::Press;
            self.series = Series {
                kind: if press { 1 } else { 2 },
                shape: [ROWS as u8, COLUMNS as u8],
                check: CHECK,
                frame_ns: pipeline.config().timing.frame_ns,
                origin: pipeline.measured_from(),
                delay_ns: if press { 0 } else { measure::strokes::DELAY_NS },
                ..Series::NONE
            };
            self.length = HEAD;
            self.restart(CaptureState::Recording, self.standing.count.wrapping_add(1));
        }
        let Self { series: head, length, bytes, row: begun, .. } = self;
        if head.kind == 0 {
            return;
        }
        if let Some(row) = pipeline.row() {
            let [begins, ends] = row.ends();
            let (count, check) = if begins { (0, head.check) } else { *begun };
            let mut out = Out::new(bytes.get_mut(*length..).unwrap_or_default(), count, check);
            out.row(&row);
            if out.full {
                let rows = head.rows.cast_signed();
                return self.end_series(measure::Ended::Full, rows);
            }
            *begun = (out.count, out.check);
            if ends {
                *length += out.count;
                (head.check, head.rows) = (out.check, head.rows + 1);
                self.standing.frames = head.rows;
            }
        }
        if !runs {
            self.end_series(motion.ended, motion.value);
        }
    }

    fn end_series(&mut self, ended: measure::Ended, value: i32) {
        let head = Series { ended, value, ..core::mem::replace(&mut self.series, Series::NONE) }.bytes();
        self.bytes.iter_mut().zip(head).for_each(|(to, byte)| *to = byte);
        let ended = if ended == measure::Ended::Full { Ended::Full } else { Ended::Asked };
        self.standing = CaptureStatus { state: CaptureState::Done, ended, bytes: self.length as u32, ..self.standing };
    }

    /// Ends the capture, or cancels it if it has not begun.
    pub fn end(&mut self, why: Ended) {
        match self.standing.state {
            CaptureState::Armed if why == Ended::Asked => self.standing.state = CaptureState::None,
            // A motion continues if the array was broken for a part of a frame.
            CaptureState::Recording if self.series.kind != 0 && why == Ended::Cut => {}
            CaptureState::Recording if self.series.kind != 0 => self.end_series(measure::Ended::Interrupted, 0),
            CaptureState::Recording => {
                let (bits, frames) = (self.place.bits(), self.standing.frames);
                let digest = digest_words(self.last.digest, core::iter::once(why as u32));
                let (head, body) = self.bytes.split_at_mut(Head::<ROWS, COLUMNS>::BYTES.min(BYTES));
                let check = Writer::new(body, self.place).finish();
                Head::<ROWS, COLUMNS>::close(head, why, [frames, bits, digest, check]);
                self.standing.state = CaptureState::Done;
                self.standing.ended = why;
                self.standing.bytes = head.len() as u32 + bits.div_ceil(8);
            }
            CaptureState::None | CaptureState::Armed | CaptureState::Done => {}
        }
    }
}

fn put_sense(out: &mut Writer<'_>, sense: &Sense, last: &Sense) {
    let Sense { encoder, supply_mv, bus_silent_ms, bridge_fault, answer, chip } = *sense;
    out.signed(encoder.wrapping_sub(last.encoder), width::ENCODER);
    out.signed(i32::from(supply_mv) - i32::from(last.supply_mv), width::SUPPLY);
    out.signed(i32::from(bus_silent_ms) - i32::from(last.bus_silent_ms), width::SILENT);
    out.put(bridge_fault.into(), 1);
    out.signed(answer.0.wrapping_sub(last.answer.0).cast_signed(), width::ANSWER);
    out.put(chip.is_some().into(), 1);
    if let Some(chip) = chip {
        out.signed(chip.to_bits().wrapping_sub(last.chip.unwrap_or_default().to_bits()), width::CHIP);
    }
}

fn put_command(out: &mut Writer<'_>, command: &Command, last: &Command) {
    if command == last {
        return out.put(0, 1);
    }
    let Command { torque, goal, bus_watchdog_ms, fit_level, tare_forced, .. } = *command;
    let Command { tare_request, clear_request, measure_request, .. } = *command;
    out.put(1 | u32::from(torque) << 1 | u32::from(tare_forced) << 2, 3);
    out.put(goal.to_bits().cast_unsigned(), 32);
    out.put(u32::from(bus_watchdog_ms) | (fit_level as u32) << 16 | u32::from(tare_request) << 24, 32);
    out.put(u16::from_le_bytes([clear_request, measure_request]).into(), 16);
}

/// Number of ones after which a number follows with all its bits.
pub const ESCAPE: u32 = 12;
/// Largest width.
pub(super) const WIDTH_MAX: u32 = 16;

/// Position of the next bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// Bits that are not yet a word, from the lowest one on: fewer than 32.
    held: u32,
    count: u32,
    /// Position of their word.
    at: usize,
    /// Check sum of the words before.
    check: u32,
}

impl Place {
    /// Position of the first bit.
    pub const START: Self = Self { held: 0, count: 0, at: 0, check: 0 };

    /// Number of bits written.
    pub fn bits(&self) -> u32 {
        8 * self.at as u32 + self.count
    }
}

/// Writes bits.
pub(super) struct Writer<'a> {
    bytes: &'a mut [u8],
    pub place: Place,
    /// True if there was no room for a word: it and all that follows is lost.
    pub full: bool,
}

impl<'a> Writer<'a> {
    pub fn new(bytes: &'a mut [u8], place: Place) -> Self {
        Self { bytes, place, full: false }
    }

    /// Writes the low bits of a number, at most 32; those above must be 0.
    #[inline(never)]
    pub fn put(&mut self, value: u32, count: u32) {
        self.put_inlined(value, count);
    }

    #[inline(always)]
    fn put_inlined(&mut self, value: u32, count: u32) {
        self.place.held |= value << self.place.count;
        self.place.count += count;
        if self.place.count >= 32 {
            self.word(self.place.held);
            self.place.count -= 32;
            // The part that did not fit: nothing if 32 bits fill a word.
            self.place.held = value.checked_shr(count - self.place.count).unwrap_or(0);
        }
    }

    /// Writes a whole word.
    #[inline(always)]
    fn word(&mut self, word: u32) {
        let place = &mut self.place;
        match self.bytes.get_mut(place.at..).and_then(|rest| rest.first_chunk_mut()) {
            Some(to) => *to = word.to_le_bytes(),
            None => self.full = true,
        }
        place.at += 4;
        place.check = mix(place.check, word);
    }

    /// Writes codes as their folded differences to those before, each of 16 bits at most. Returns the sum of the
    /// differences.
    ///
    /// As [`Writer::signed`] for each, with the word under way in registers: a frame has a hundred of them.
    #[inline(never)]
    pub fn codes(&mut self, codes: &[u16], before: &[u16], width: u32) -> u32 {
        let width = width & 31;
        let (mut sum, mask, more) = (0_u32, (1 << width) - 1, width + 1);
        let (mut held, mut filled) = (self.place.held, self.place.count);
        for (&code, &before) in codes.iter().zip(before) {
            let value = fold(code, before);
            sum = sum.wrapping_add(value);
            let ones = value >> width;
            if ones >= ESCAPE {
                (self.place.held, self.place.count) = (held, filled);
                self.put((1 << ESCAPE) - 1, ESCAPE);
                self.put(value, 16);
                (held, filled) = (self.place.held, self.place.count);
                continue;
            }
            // The low bits, a 0, and as many ones, from the highest bit on.
            let bits = ((2 * (value & mask) + 1) << ones) - 1;
            let count = ones + more;
            held |= bits << (filled & 31);
            filled += count;
            if filled >= 32 {
                self.word(held);
                filled -= 32;
                held = bits >> (count.wrapping_sub(filled) & 31);
            }
        }
        (self.place.held, self.place.count) = (held, filled);
        sum
    }

    /// Writes the last bits, and returns the check sum of all.
    pub fn finish(self) -> u32 {
        let place = self.place;
        if let Some(to) = self.bytes.get_mut(place.at..).and_then(|rest| rest.first_chunk_mut()) {
            *to = place.held.to_le_bytes();
        }
        mix(place.check, place.held)
    }

    /// Writes a difference of 32 bits.
    pub fn signed(&mut self, value: i32, width: u32) {
        let value = (value << 1 ^ value >> 31).cast_unsigned();
        let ones = value >> width;
        let (bits, count) = if ones < ESCAPE {
            let low = value & ((1 << width) - 1);
            (low << (ones + 1) | ((1 << ones) - 1), ones + 1 + width)
        } else {
            self.put((1 << ESCAPE) - 1, ESCAPE);
            (value, 32)
        };
        self.put_inlined(bits, count);
    }
}

/// Rotates, mixes and multiplies by an odd number (2^32 over the golden ratio), so that different words give
/// different sums.
#[inline(always)]
pub(super) const fn mix(sum: u32, word: u32) -> u32 {
    (sum.rotate_left(5) ^ word).wrapping_mul(0x9E37_79B1)
}

/// Returns a difference of 16 bits, folded.
#[inline(always)]
pub(super) fn fold(value: u16, last: u16) -> u32 {
    let difference = i32::from(value.wrapping_sub(last).cast_signed());
    (difference << 1 ^ difference >> 31).cast_unsigned()
}
