//! Inputs and outputs of a step as bytes: recordings to replay, and a digest to compare runs.
//!
//! A recording is [`MAGIC`], the number of records as a little-endian u32, and that many records of [`Record::BYTES`].

use crc::{CRC_64_XZ, Crc, Table};
use fingertip::command::Command;
use fingertip::contact::FitLevel;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, SLOTS};
use fingertip::units::{Celsius, CoreCycles, Duty, Newtons};

/// The first bytes of a recording; the last one counts the versions of its layout.
pub const MAGIC: [u8; 8] = *b"fingert\x07";

/// The temperature that was not measured.
const UNMEASURED: i32 = i32::MIN;

/// The arguments of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    pub frame: Frame,
    /// Sensed values other than the frame.
    pub sense: Sense,
    pub command: Command,
}

impl Record {
    /// Bytes of a record: 110 codes, the sequence number, the sense, the command.
    pub const BYTES: usize = 2 * 10 * SLOTS + 4 + 17 + 11;

    /// The fields in the order of their definition, little-endian.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let Self { frame, sense, command } = self;
        let mut bytes = [0; Self::BYTES];
        let mut rest = &mut bytes[..];
        let mut put = |value: &[u8]| {
            if let Some((place, after)) = core::mem::take(&mut rest).split_at_mut_checked(value.len()) {
                place.copy_from_slice(value);
                rest = after;
            }
        };
        places().for_each(|(slot, column)| put(&frame.code(slot, column).to_le_bytes()));
        put(&frame.sequence.to_le_bytes());
        let Sense { encoder, supply_mv, bus_silent_ms, bridge_fault, chip, answer } = sense;
        put(&encoder.to_le_bytes());
        put(&supply_mv.to_le_bytes());
        put(&bus_silent_ms.to_le_bytes());
        put(&[u8::from(*bridge_fault)]);
        put(&chip.map_or(UNMEASURED, Celsius::to_bits).to_le_bytes());
        put(&answer.0.to_le_bytes());
        // Recordings are made of tared fingers: no tare is forced.
        let Command { torque, goal, bus_watchdog_ms, fit_level, tare_forced: _, .. } = command;
        let Command { tare_request, clear_request, measure_request, .. } = command;
        put(&[u8::from(*torque)]);
        put(&goal.to_bits().to_le_bytes());
        put(&bus_watchdog_ms.to_le_bytes());
        put(&[*fit_level as u8, *tare_request, *clear_request, *measure_request]);
        bytes
    }

    /// The inverse of [`Record::to_bytes`]; any byte but 0 is true, and any number above the largest fit level is that.
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let mut rest = &bytes[..];
        let mut frame = Frame::EMPTY;
        places().for_each(|(slot, column)| frame.set_code(slot, column, u16::from_le_bytes(take(&mut rest))));
        frame.sequence = u32::from_le_bytes(take(&mut rest));
        let sense = Sense {
            encoder: i32::from_le_bytes(take(&mut rest)),
            supply_mv: u16::from_le_bytes(take(&mut rest)),
            bus_silent_ms: u16::from_le_bytes(take(&mut rest)),
            bridge_fault: take(&mut rest) != [0],
            chip: Some(Celsius::from_bits(i32::from_le_bytes(take(&mut rest))))
                .filter(|chip| chip.to_bits() != UNMEASURED),
            answer: CoreCycles(u32::from_le_bytes(take(&mut rest))),
        };
        let command = Command {
            torque: take(&mut rest) != [0],
            goal: Newtons::from_bits(i32::from_le_bytes(take(&mut rest))),
            bus_watchdog_ms: u16::from_le_bytes(take(&mut rest)),
            fit_level: FitLevel::from_number(u8::from_le_bytes(take(&mut rest))),
            tare_request: u8::from_le_bytes(take(&mut rest)),
            clear_request: u8::from_le_bytes(take(&mut rest)),
            measure_request: u8::from_le_bytes(take(&mut rest)),
            tare_forced: false,
        };
        Self { frame, sense, command }
    }
}

/// Slot by slot, column by column.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column)))
}

/// The next bytes; zeros beyond the end.
fn take<const N: usize>(rest: &mut &[u8]) -> [u8; N] {
    let (value, after) = rest.split_first_chunk().map_or(([0; N], &[][..]), |(value, after)| (*value, after));
    *rest = after;
    value
}

static CRC: Crc<u64, Table<1>> = Crc::<u64, Table<1>>::new(&CRC_64_XZ);

/// CRC-64/XZ of every duty and every field of every status, in order: equal where two runs agree bit for bit.
pub struct Digest(crc::Digest<'static, u64, Table<1>>);

impl Digest {
    /// Digest of no steps.
    pub fn new() -> Self {
        Self(CRC.digest())
    }

    pub fn add(&mut self, duty: Duty, status: &Status) {
        status.words(duty, |word| self.0.update(&word.to_le_bytes()));
    }

    pub fn value(self) -> u64 {
        self.0.finalize()
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingertip::measure::{MeasureStatus, Task};
    use fingertip::pipeline::Taring;
    use fingertip::state::{Fault, Limits, Mode};
    use fingertip::units::{Millimetres, MillimetresPerSecond};

    #[test]
    fn a_record_survives_the_way_to_bytes_and_back() {
        let mut bytes = [0; Record::BYTES];
        bytes.iter_mut().zip(1..=254).for_each(|(byte, value)| *byte = value);
        let record = Record::from_bytes(&bytes);
        assert_eq!(record.frame.code(0, 0), 0x0201);
        assert_eq!(record.command.measure_request, 252);
        let again = record.to_bytes();
        assert_eq!(Record::from_bytes(&again), record);
        // Bytes differ where a truth value was neither 0 nor 1, where a fit level was none, and nowhere else.
        let differing = bytes.iter().zip(&again).enumerate().filter(|(_, (a, b))| a != b).map(|(place, _)| place);
        assert!(differing.eq([232, 241, 248]));
    }

    #[test]
    fn every_field_of_a_status_counts() {
        let digest = |duty, change: fn(&mut Status)| {
            let (mut status, mut digest) = (Status::default(), Digest::new());
            change(&mut status);
            digest.add(duty, &status);
            digest.value()
        };
        let changes: [fn(&mut Status); 27] = [
            |_| (),
            |status| status.sequence = 1,
            |status| status.missed_frames = 1,
            |status| status.mode = Mode::Force,
            |status| status.fault = Some(Fault::LostFrames),
            |status| status.limits = Limits(1),
            |status| status.fit_level = FitLevel::AllRows,
            |status| status.travel = Millimetres::from_bits(1),
            |status| status.speed = MillimetresPerSecond::from_bits(1),
            |status| status.duty = Duty(1),
            |status| status.contact.force = Newtons::from_bits(1),
            |status| status.creep = Newtons::from_bits(1),
            |status| status.chip = Some(Celsius::from_bits(1)),
            |status| status.drift = Newtons::from_bits(1),
            |status| status.winding = Celsius::from_bits(1),
            |status| status.contact.indentation = Millimetres::from_bits(1),
            |status| status.contact.centre_x = Millimetres::from_bits(1),
            |status| status.contact.centre_y = Millimetres::from_bits(1),
            |status| status.contact.radius = Millimetres::from_bits(1),
            |status| status.contact.peak_pa = 1,
            |status| status.contact.confidence = 1,
            |status| status.contact.bad_taxels = 1,
            |status| status.tare = Taring::Running,
            |status| status.taken.tare = 1,
            |status| status.taken.clear = 1,
            |status| status.taken.measure = 1,
            |status| status.measure = MeasureStatus::running(Task::Press),
        ];
        let mut values = changes.map(|change| digest(Duty::ZERO, change)).to_vec();
        values.push(digest(Duty(1), |_| ()));
        let count = values.len();
        values.sort_unstable();
        values.dedup();
        assert_eq!(values.len(), count);
    }
}
