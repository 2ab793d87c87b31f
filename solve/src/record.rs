//! The bytes of a recorded series, as the chip delivers them.
//!
//! A series is a head of 32 bytes and a body of records, little-endian throughout; [`fingertip::measure::series`] has the
//! layout. A damaged series gives a [`NoRecord`]; no bytes make this module panic.
//!
//! Lengths in millimetres, the tip and the array's scale are not in the series: they come from the controller's parameters.

pub use fingertip::measure::Ended as Reason;

use crate::Value;
use crate::press::{Array, Branch, Press, Reading, Step};
use crate::strokes::{Record, Sample, Stroke};
use fingertip::measure::series::{HEAD, VERSION, check, step_bytes};
use fingertip::measure::strokes::SAMPLE_FRAMES;
use fingertip::params::{ParamError, Params};
use std::f64::consts::TAU;
use std::fmt;

/// First bytes of a series.
pub const MAGIC: [u8; 3] = *b"FTS";
/// Count that marks the start of a stroke.
pub const START: i16 = i16::MIN;
/// Limit to which the chip clips counts and voltages.
const CLIPPED: u16 = 32_767;

/// Codes of a mean: an eighth of a code, from -128 codes.
const CODES_PER_LSB: f64 = 0.125;
const LEAST_CODES: f64 = -128.0;
/// Standard deviations are coded as variances in the square of this, codes.
const DEVIATION_CODES: f64 = 0.25;
/// Voltage of a sample's unit, V.
const VOLTS_PER_LSB: f64 = 0.25e-3;
/// Absolute zero, degrees Celsius.
const ZERO_K: f64 = -273.15;
/// Bytes of a press step before its taxels.
const TAXELS_AT: usize = 24;
/// Standard uncertainty of the resistance in the parameters, as a share: 1 % of an ohmmeter, and copper that is 5 K warmer
/// than it was then (0.4 %/K).
const RESISTANCE_PART: f64 = 0.022;

#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Kind {
    #[error("a press")]
    Press = 1,
    #[error("strokes")]
    Strokes = 2,
}

/// Early end of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Reason, as the chip numbers it.
    pub reason: Reason,
    /// The number behind it, in the unit that the [`Reason`] states; 0 for those without a unit.
    pub value: i32,
}

impl std::error::Error for Ended {}

/// Reason why bytes are not a series, with the number behind it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoRecord {
    #[error("the series has {0} bytes; its head alone has {HEAD}")]
    Short(usize),
    #[error("the bytes begin with {0:02x?}, not with \"FTS\": they are not a series")]
    Magic([u8; 3]),
    #[error("the series has format {0}; this program reads format {VERSION}")]
    Version(u8),
    #[error("the series does not hold {0}: its kind is {1} (1 is a press, 2 are strokes)")]
    Kind(Kind, u8),
    #[error("the series ended early for reason {0}, which this program does not know")]
    Reason(u8),
    #[error("the array has {0} rows and {1} columns; both must be at least 1")]
    Shape(u8, u8),
    #[error("the series has {1} bytes where its head says {0}: it was cut or joined")]
    Length(u64, usize),
    #[error("the check of the body is {1:08x} where the head says {0:08x}: bytes were changed in transfer")]
    Check(u32, u32),
    #[error("the head says a frame time of 0")]
    FrameTime,
    #[error("step {0} ends before it begins, or begins before the step before it ended")]
    Order(usize),
    #[error("step {0} has no frames")]
    Frames(usize),
    #[error("step {0} has branch {1}; 0 (in or held) and 1 (back) are known")]
    Branch(usize, u8),
    #[error("sample {0} belongs to no stroke, or marks the start of a stroke with a voltage")]
    Stroke(usize),
    #[error(
        "sample {0} holds count {1} and voltage {2}: the chip clips both at 32767; take an encoder or a gear with fewer counts for each mm, or a lower supply"
    )]
    Clipped(usize, i16, i16),
    #[error("the controller's parameters are not valid: {0}")]
    Params(#[from] ParamError),
}

pub fn press(bytes: &[u8], params: &Params) -> Result<Press, NoRecord> {
    params.check()?;
    let (head, body) = Head::of(bytes, Kind::Press)?;
    let mm_per_count = TAU / f64::from(params.encoder_counts_per_turn) / rad_per_mm(params);
    let array = Array {
        rows: head.shape[0],
        columns: head.shape[1],
        pitch_mm: 1e-3 * f64::from(params.pitch_um),
        // The chip takes the characteristic out of the codes, which leaves those of the full range.
        codes_per_kpa: f64::from(params.codes_per_kpa_milli) / f64::from(1_000 + params.curve_permille),
    };
    let mut steps: Vec<Step> = Vec::new();
    let mut before = 0;
    for (index, record) in body.chunks_exact(head.record).enumerate() {
        let frames = [0, 4].map(|at| u32::from_le_bytes(number(record, at)));
        let counts = [8, 12].map(|at| i32::from_le_bytes(number(record, at)));
        let [averaged, chip] = [16, 22].map(|at| u16::from_le_bytes(number(record, at)));
        if frames[0] > frames[1] || frames[0] < before {
            return Err(NoRecord::Order(index));
        } else if averaged == 0 {
            return Err(NoRecord::Frames(index));
        }
        before = frames[1];
        let branch = match record[18] {
            0 => Branch::Loading,
            1 => Branch::Unloading,
            other => return Err(NoRecord::Branch(index, other)),
        };
        let [deviations, bits] = [2, 3].map(|bytes| TAXELS_AT + bytes * array.taxels());
        let taxel = |taxel: usize| {
            let mean = f64::from(u16::from_le_bytes(number(record, TAXELS_AT + 2 * taxel)));
            Reading {
                mean: CODES_PER_LSB * mean + LEAST_CODES,
                deviation: deviation(record[deviations + taxel]),
                bad: record[bits + taxel / 8] >> (taxel % 8) & 1 == 1,
            }
        };
        let taxels = (0..array.taxels()).map(taxel).collect();
        steps.push(Step {
            time_s: frames.map(|frame| f64::from(frame) * head.frame_s),
            travel_mm: counts.map(|count| (f64::from(count) - f64::from(head.origin)) * mm_per_count),
            frames: averaged.into(),
            branch,
            taxels,
            chip_c: (chip > 0).then(|| 0.1 * f64::from(chip) + ZERO_K),
        });
    }
    Ok(Press { radius_mm: 1e-3 * f64::from(params.tip_radius_um), array, steps, ended: head.ended })
}

/// Strokes of a series. The resistance is that of the parameters, with an uncertainty of 2.2 %; a caller with a better
/// measurement overwrites it.
pub fn strokes(bytes: &[u8], params: &Params) -> Result<Record, NoRecord> {
    params.check()?;
    let (head, body) = Head::of(bytes, Kind::Strokes)?;
    let mut strokes: Vec<Stroke> = Vec::new();
    for (index, record) in body.chunks_exact(head.record).enumerate() {
        let [count, voltage] = [0, 2].map(|at| i16::from_le_bytes(number(record, at)));
        if count == START && voltage == 0 {
            strokes.push(Stroke::default());
            continue;
        }
        let stroke = strokes.last_mut().filter(|_| count != START).ok_or(NoRecord::Stroke(index))?;
        if count.unsigned_abs() >= CLIPPED || voltage.unsigned_abs() >= CLIPPED {
            return Err(NoRecord::Clipped(index, count, voltage));
        }
        stroke.samples.push(Sample { count: count.into(), voltage_v: VOLTS_PER_LSB * f64::from(voltage) });
    }
    let ohm = 1e-3 * f64::from(params.resistance_mohm);
    Ok(Record {
        sample_s: f64::from(SAMPLE_FRAMES) * head.frame_s,
        delay_s: 1e-9 * f64::from(head.delay_ns),
        counts_per_turn: params.encoder_counts_per_turn.into(),
        rad_per_mm: rad_per_mm(params),
        resistance: Value { value: ohm, sigma: RESISTANCE_PART * ohm },
        strokes,
        ended: head.ended,
    })
}

fn rad_per_mm(params: &Params) -> f64 {
    1e-3 * f64::from(params.reduction_mrad_per_mm)
}

/// Standard deviation in codes from its byte: a variance with a mantissa of 3 bits and an exponent of 5.
fn deviation(byte: u8) -> f64 {
    if byte == 0 {
        return 0.0;
    }
    let variance = ((8 + u64::from(byte & 7)) << (byte >> 3)) >> 3;
    DEVIATION_CODES * (variance as f64).sqrt()
}

struct Head {
    shape: [usize; 2],
    ended: Option<Ended>,
    /// Length of a record, bytes.
    record: usize,
    frame_s: f64,
    origin: i32,
    delay_ns: u32,
}

impl Head {
    /// Head and body of a series of this kind.
    fn of(bytes: &[u8], kind: Kind) -> Result<(Self, &[u8]), NoRecord> {
        let (head, body) = bytes.split_at_checked(HEAD).ok_or(NoRecord::Short(bytes.len()))?;
        let [magic @ .., version, number, rows, columns, ended]: [u8; 8] = self::number(head, 0);
        let [records, expected, frame_ns, delay_ns] =
            [8, 12, 16, 24].map(|at| u32::from_le_bytes(self::number(head, at)));
        let [origin, value] = [20, 28].map(|at| i32::from_le_bytes(self::number(head, at)));
        if magic != MAGIC {
            return Err(NoRecord::Magic(magic));
        } else if version != VERSION {
            return Err(NoRecord::Version(version));
        } else if number != kind as u8 {
            return Err(NoRecord::Kind(kind, number));
        } else if kind == Kind::Press && (rows == 0 || columns == 0) {
            return Err(NoRecord::Shape(rows, columns));
        } else if frame_ns == 0 {
            return Err(NoRecord::FrameTime);
        }
        let ended = match ended {
            0 => None,
            number => Some(Ended { reason: Reason::of(number).ok_or(NoRecord::Reason(number))?, value }),
        };
        let shape = [rows, columns].map(usize::from);
        let record = match kind {
            Kind::Press => step_bytes(shape[0] * shape[1]),
            Kind::Strokes => 4,
        };
        let length = HEAD as u64 + u64::from(records) * record as u64;
        if length != bytes.len() as u64 {
            return Err(NoRecord::Length(length, bytes.len()));
        }
        let found = check(body);
        if found != expected {
            return Err(NoRecord::Check(expected, found));
        }
        Ok((Self { shape, ended, record, frame_s: 1e-9 * f64::from(frame_ns), origin, delay_ns }, body))
    }
}

/// The bytes from a place on; the lengths were checked before.
fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    *bytes[at..].first_chunk().expect("the number lies within its record")
}

impl fmt::Display for Ended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.value;
        let thousandths = 1e-3 * f64::from(value);
        match self.reason {
            Reason::Complete => write!(f, "the motion is complete"),
            Reason::Interrupted => {
                write!(f, "a stop, torque, a fault, a tare or new parameters ended the motion: run it again")
            }
            Reason::NotReady => {
                write!(
                    f,
                    "not tared, something touches the tip, or torque is not as needed: free the tip, tare, run it again"
                )
            }
            Reason::Unconfirmed => write!(f, "the motor's direction is not confirmed: `fingertip commission` does it"),
            Reason::Still => write!(
                f,
                "the encoder did not count at {thousandths:.2} V: is the motor connected, the encoder supplied, the tip free?"
            ),
            Reason::Reversed => write!(
                f,
                "the encoder counted {value} against the voltage: swap the motor's leads if the tip went back first, else the \
                 encoder's channels"
            ),
            Reason::Astray => write!(
                f,
                "the tip was {thousandths:.2} mm away, outside of its bounds: is a channel of the encoder open?"
            ),
            Reason::Touched => write!(
                f,
                "the array measured {thousandths:.3} N, more than allowed here: clear the tip's way, hold the plate fast"
            ),
            Reason::Pushed => {
                write!(f, "an external force of {thousandths:.3} N was estimated from the motor: clear the tip's way")
            }
            Reason::Restless => {
                write!(f, "the tip did not come to rest: it still went {value} counts; hold the finger fast")
            }
            Reason::NoContact => {
                write!(
                    f,
                    "the tip met nothing within {thousandths:.2} mm: bring the plate nearer, or push the tip back"
                )
            }
            Reason::Stalled => write!(
                f,
                "the tip stopped at {thousandths:.2} mm before it was deep enough: is current_max_ma too small, or the \
                 tip blocked?"
            ),
            Reason::Full => write!(
                f,
                "the memory was full after {value} records: lower modulus or force_max_mn make a shorter press"
            ),
        }
    }
}
