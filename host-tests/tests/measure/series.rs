//! The layout of a record, read by a decoder from the documentation of `fingertip::measure::series` alone.

use crate::common::*;
use fingertip::measure::Row;
use fingertip::measure::press::{PARTS, Step};
use fingertip::measure::series::{CHECK, Head, Out, step_bytes};

pub struct Read {
    pub frames: [u32; 2],
    pub counts: [i32; 2],
    pub taken: u16,
    pub back: bool,
    pub voltage_mv: i16,
    pub tenths_k: u16,
    /// Mean of each taxel, codes above tare.
    pub means: Vec<f64>,
    /// Variance of each taxel, codes squared.
    pub variances: Vec<f64>,
    pub bad: Vec<bool>,
}

/// A record: its head without the check sum, and its rows.
pub struct Record {
    pub kind: u8,
    pub shape: [usize; 2],
    pub ended: u8,
    pub frame_ns: u32,
    pub origin: i32,
    pub delay_ns: u32,
    pub value: i32,
    pub rows: u32,
    pub steps: Vec<Read>,
    pub samples: Vec<[i16; 2]>,
}

fn number<const BYTES: usize>(bytes: &mut &[u8]) -> [u8; BYTES] {
    let (first, rest) = bytes.split_first_chunk().expect("more bytes");
    *bytes = rest;
    *first
}

pub fn decode(mut bytes: &[u8]) -> Record {
    let from = &mut bytes;
    assert_eq!(number(from), *b"FTS\x01");
    let [kind, rows, columns, ended] = number(from);
    let shape = [rows.into(), columns.into()];
    let rows = u32::from_le_bytes(number(from));
    let check = u32::from_le_bytes(number(from));
    let frame_ns = u32::from_le_bytes(number(from));
    let [origin, delay_ns, value] = [(); 3].map(|()| i32::from_le_bytes(number(from)));
    let sum = from.iter().fold(0x811C_9DC5_u32, |sum, byte| (sum ^ u32::from(*byte)).wrapping_mul(0x0100_0193));
    assert_eq!(check, sum, "the check sum");
    let (mut steps, mut samples) = (Vec::new(), Vec::new());
    for _ in 0..rows {
        if kind == 1 {
            steps.push(step(from, shape[0] * shape[1]));
        } else {
            samples.push([(); 2].map(|()| i16::from_le_bytes(number(from))));
        }
    }
    assert!(from.is_empty(), "{} bytes more", from.len());
    Record { kind, shape, ended, frame_ns, origin, delay_ns: delay_ns as u32, value, rows, steps, samples }
}

fn step(from: &mut &[u8], taxels: usize) -> Read {
    let before = from.len();
    let frames = [(); 2].map(|()| u32::from_le_bytes(number(from)));
    let counts = [(); 2].map(|()| i32::from_le_bytes(number(from)));
    let taken = u16::from_le_bytes(number(from));
    let [back, 0] = number(from) else { panic!("a byte that is 0") };
    let voltage_mv = i16::from_le_bytes(number(from));
    let tenths_k = u16::from_le_bytes(number(from));
    let means = (0..taxels).map(|_| (f64::from(u16::from_le_bytes(number(from))) - 1_024.0) / 8.0).collect();
    let variance = |from: &mut &[u8]| {
        let [byte] = number(from);
        if byte == 0 { 0.0 } else { f64::from(8 + (byte & 7)) * f64::from(byte >> 3).exp2() / 8.0 / 16.0 }
    };
    let variances = (0..taxels).map(|_| variance(from)).collect();
    let bits: Vec<u8> = (0..taxels.div_ceil(8)).map(|_| number::<1>(from)[0]).collect();
    let bad = (0..taxels).map(|place| bits[place / 8] >> (place % 8) & 1 == 1).collect();
    while !(before - from.len()).is_multiple_of(4) {
        assert_eq!(number(from), [0]);
    }
    Read { frames, counts, taken, back: back == 1, voltage_mv, tenths_k, means, variances, bad }
}

/// The bytes of these rows behind a head.
fn written<const ROWS: usize, const COLUMNS: usize>(rows: &[Row<'_, ROWS, COLUMNS>], kind: u8) -> Vec<u8> {
    let mut body = vec![0; rows.len() * step_bytes(ROWS * COLUMNS)];
    let (mut length, mut check) = (0, CHECK);
    let mut count = 0;
    for row in rows {
        let mut put = |row: &Row<'_, ROWS, COLUMNS>| {
            let [begins, ends] = row.ends();
            let mut out = Out::new(&mut body[length..], if begins { 0 } else { count }, check);
            out.row(row);
            assert!(!out.full);
            (count, check) = (out.count, out.check);
            length += if ends { count } else { 0 };
        };
        match row {
            Row::Step(step, _) => (0..PARTS).for_each(|part| put(&Row::Step(step, part))),
            other => put(other),
        }
    }
    let head = Head {
        kind,
        shape: [ROWS as u8, COLUMNS as u8],
        ended: Ended::Stalled,
        rows: rows.len() as u32,
        check,
        frame_ns: 99_762,
        origin: -77_000,
        delay_ns: 33_000,
        value: -5,
    };
    [&head.bytes(), &body[..length]].concat()
}

/// Sums of a press step over the readings of its frames, in sixteenths of a code.
fn sums<const ROWS: usize, const COLUMNS: usize>(frames: &[[[i32; COLUMNS]; ROWS]]) -> Step<ROWS, COLUMNS> {
    let mut step = Step { first: frames[0], taken: frames.len() as u16, ..Step::NONE };
    for frame in frames {
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                step.sums[row][column] += frame[row][column];
                let change = (frame[row][column] - frames[0][row][column]) >> 2;
                step.squares[row][column] += (change * change) as u32;
            }
        }
    }
    step
}

fn comes_back<const ROWS: usize, const COLUMNS: usize>() {
    let mut random = fastrand::Rng::with_seed(30);
    let steps: Vec<_> = (0..20)
        .map(|number| {
            let level: [[i32; COLUMNS]; ROWS] =
                core::array::from_fn(|_| core::array::from_fn(|_| random.i32(-1_600..60_000)));
            let noise = [0, 16, 160, 1_600][number % 4];
            let count = 1 + number * number;
            let frames: Vec<_> =
                (0..count).map(|_| level.map(|row| row.map(|taxel| taxel + random.i32(-noise..=noise)))).collect();
            let mut step = sums(&frames);
            (step.frames, step.counts) = ([random.u32(..), random.u32(..)], [random.i32(..), random.i32(..)]);
            (step.back, step.voltage_mv) = (number % 2 == 1, random.i32(-6_000..6_000) * count as i32);
            step.chip = (number % 3 != 0).then(|| Celsius::from_bits(random.i32(-40 << 16..125 << 16)));
            step.bad = core::array::from_fn(|_| random.u32(..) & ((1_u64 << COLUMNS) - 1) as u32);
            (step, frames)
        })
        .collect();
    let rows: Vec<_> = steps.iter().map(|(step, _)| Row::Step(step, 0)).collect();
    let record = decode(&written(&rows, 1));
    assert_eq!((record.kind, record.shape, record.ended), (1, [ROWS, COLUMNS], 12));
    assert_eq!((record.frame_ns, record.origin, record.delay_ns, record.value), (99_762, -77_000, 33_000, -5));
    for ((step, frames), read) in steps.iter().zip(&record.steps) {
        assert_eq!((read.frames, read.counts), (step.frames, step.counts));
        assert_eq!((read.taken, read.back), (step.taken, step.back));
        assert_eq!(i32::from(read.voltage_mv), step.voltage_mv / i32::from(step.taken));
        let kelvin = step.chip.map_or(0.0, |chip| chip.0.to_num::<f64>() + 273.15);
        assert!((f64::from(read.tenths_k) / 10.0 - kelvin).abs() <= 0.15, "{} {kelvin}", read.tenths_k);
        for place in 0..ROWS * COLUMNS {
            let (row, column) = (place / COLUMNS, place % COLUMNS);
            let codes: Vec<f64> = frames.iter().map(|frame| f64::from(frame[row][column]) / 16.0).collect();
            let mean = codes.iter().sum::<f64>() / codes.len() as f64;
            assert!((read.means[place] - mean).abs() <= 0.126, "{} codes, not {mean}", read.means[place]);
            let variance = codes.iter().map(|code| (code - mean).powi(2)).sum::<f64>() / codes.len() as f64;
            let (sigma, read_sigma) = (variance.sqrt(), read.variances[place].sqrt());
            assert!((sigma - read_sigma).abs() <= 0.1 * sigma + 0.6, "{read_sigma} codes, not {sigma}");
            assert_eq!(read.bad[place], step.bad[row] >> column & 1 == 1, "taxel {place}");
        }
    }
}

#[test]
fn a_press_comes_back_from_its_bytes() {
    comes_back::<3, 3>();
    comes_back::<10, 10>();
    comes_back::<16, 32>();
}

#[test]
fn strokes_come_back_from_their_bytes() {
    let sample = |count, voltage| Row::Sample { count, voltage };
    let rows = [Row::Stroke, sample(-1, i16::MAX), sample(i16::MAX, -2), Row::<10, 10>::Stroke];
    let record = decode(&written(&rows, 2));
    assert_eq!(record.samples, [[i16::MIN, 0], [-1, i16::MAX], [i16::MAX, -2], [i16::MIN, 0]]);
}

/// Sums at the limits of their range, and zeros: no overflow, and the means keep their sign.
#[test]
fn the_ends_of_the_sums_are_written() {
    const MOST: i32 = 1 << 17;
    for taken in [0, 1, 2, 16_383] {
        for reading in [-MOST, 0, MOST] {
            for first in [-MOST, 0, MOST] {
                for square in [0, 1, u32::MAX] {
                    let step = Step::<3, 5> {
                        taken,
                        sums: [[reading * i32::from(taken); 5]; 3],
                        first: [[first; 5]; 3],
                        squares: [[square; 5]; 3],
                        voltage_mv: i32::MIN,
                        chip: Some(Celsius::from_bits(i32::MIN)),
                        ..Step::NONE
                    };
                    let read = &decode(&written(&[Row::Step(&step, 0)], 1)).steps[0];
                    let mean = if taken == 0 { 0.0 } else { f64::from(reading) / 16.0 };
                    assert_eq!(read.means[14], mean.clamp(-128.0, (65_535.0 - 1_024.0) / 8.0));
                    assert_eq!(read.tenths_k, 0);
                }
            }
        }
    }
}
