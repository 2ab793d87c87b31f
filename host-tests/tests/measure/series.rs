//! The layout of a record: what the core writes is what the host's solver reads. Tests of the solver hold it against bytes
//! that are written by hand after the documentation of `fingertip::measure::series`.

use crate::common::*;
use fingertip::measure::Row;
use fingertip::measure::press::{PARTS, Step};
use fingertip::measure::series::{CHECK, HEAD, Head, Out, step_bytes};
use solve::press::Branch;
use solve::record::press;
use std::f64::consts::TAU;

fn number<const BYTES: usize>(bytes: &[u8], at: usize) -> [u8; BYTES] {
    *bytes[at..].first_chunk().expect("more bytes")
}

/// Kind of a record, number of the reason of its end, number of rows, and the value that explains the end.
pub fn head(bytes: &[u8]) -> (u8, u8, u32, i32) {
    (bytes[4], bytes[7], u32::from_le_bytes(number(bytes, 8)), i32::from_le_bytes(number(bytes, 28)))
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
            let first = 1_000 * number as u32;
            step.frames = [first, first + random.u32(..1_000)];
            step.counts = [random.i32(..), random.i32(..)];
            (step.back, step.voltage_mv) = (number % 2 == 1, random.i32(-6_000..6_000) * count as i32);
            step.chip = (number % 3 != 0).then(|| Celsius::from_bits(random.i32(-40 << 16..125 << 16)));
            step.bad = core::array::from_fn(|_| random.u32(..) & ((1_u64 << COLUMNS) - 1) as u32);
            (step, frames)
        })
        .collect();
    let rows: Vec<_> = steps.iter().map(|(step, _)| Row::Step(step, 0)).collect();
    let bytes = written(&rows, 1);
    assert_eq!(head(&bytes), (1, Ended::Stalled as u8, 20, -5));
    let record = press(&bytes, &Params::DEFAULT).expect("a press");
    assert_eq!((record.array.rows, record.array.columns), (ROWS, COLUMNS));
    let ended = record.ended.expect("an early end");
    assert_eq!((ended.reason, ended.value), (Ended::Stalled, -5));
    let mm_per_count = TAU / 1_600.0 / 3.583;
    for (place, ((step, frames), read)) in steps.iter().zip(&record.steps).enumerate() {
        let back = if step.back { Branch::Unloading } else { Branch::Loading };
        assert_eq!((read.frames, read.branch), (step.taken.into(), back));
        for end in 0..2 {
            let travel_mm = (f64::from(step.counts[end]) + 77_000.0) * mm_per_count;
            assert!((read.time_s[end] - 99_762e-9 * f64::from(step.frames[end])).abs() < 1e-9);
            assert!((read.travel_mm[end] - travel_mm).abs() < 1e-6, "{:?}", step.counts);
        }
        // The host reads neither the voltage nor the bytes that are 0.
        let row = &bytes[HEAD + place * step_bytes(ROWS * COLUMNS)..][..step_bytes(ROWS * COLUMNS)];
        let voltage_mv = i16::from_le_bytes(number(row, 20));
        let padding = 24 + 3 * ROWS * COLUMNS + (ROWS * COLUMNS).div_ceil(8);
        assert!(row[19] == 0 && row[padding..].iter().all(|byte| *byte == 0), "{row:?}");
        assert_eq!(i32::from(voltage_mv), step.voltage_mv / i32::from(step.taken));
        let [read_c, chip_c] = [read.chip_c, step.chip.map(|chip| chip.0.to_num())].map(|chip| chip.unwrap_or(-273.15));
        assert!((read_c - chip_c).abs() <= 0.15, "{read_c} {chip_c}");
        for place in 0..ROWS * COLUMNS {
            let (row, column) = (place / COLUMNS, place % COLUMNS);
            let codes: Vec<f64> = frames.iter().map(|frame| f64::from(frame[row][column]) / 16.0).collect();
            let mean = codes.iter().sum::<f64>() / codes.len() as f64;
            let taxel = read.taxels[place];
            assert!((taxel.mean - mean).abs() <= 0.126, "{} codes, not {mean}", taxel.mean);
            let variance = codes.iter().map(|code| (code - mean).powi(2)).sum::<f64>() / codes.len() as f64;
            let (sigma, read_sigma) = (variance.sqrt(), taxel.deviation);
            assert!((sigma - read_sigma).abs() <= 0.1 * sigma + 0.6, "{read_sigma} codes, not {sigma}");
            assert_eq!(taxel.bad, step.bad[row] >> column & 1 == 1, "taxel {place}");
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
    let bytes = [[i16::MIN, 0], [-1, i16::MAX], [i16::MAX, -2], [i16::MIN, 0]].as_flattened().iter().copied();
    assert!(written(&rows, 2)[HEAD..].iter().copied().eq(bytes.flat_map(i16::to_le_bytes)));
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
                    let bytes = written(&[Row::Step(&step, 0)], 1);
                    let mean = if taken == 0 { 0.0 } else { f64::from(reading) / 16.0 };
                    let eighths = 8.0 * mean.clamp(-128.0, (65_535.0 - 1_024.0) / 8.0) + 1_024.0;
                    assert_eq!(f64::from(u16::from_le_bytes(number(&bytes, HEAD + 24 + 2 * 14))), eighths);
                    assert_eq!(number(&bytes, HEAD + 22), [0; 2]);
                }
            }
        }
    }
}
