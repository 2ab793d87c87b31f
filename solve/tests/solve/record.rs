//! The bytes of a series: read to the last bit, and never a panic.

use crate::*;
use fingertip::measure::Task;
use proptest::prelude::*;
use sim::native::bench::Bench;
use solve::modulus;
use solve::record::{Kind, NoRecord, press, strokes};

const PARAMS: &Params = &Params::DEFAULT;

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found} instead of {expected}");
}

fn strokes_head(rows: u32) -> Head {
    Head { kind: 2, shape: [10, 10], rows, frame_ns: 100_000, delay_ns: 40_000, ..Head::NONE }
}

fn press_head(shape: [u8; 2], rows: u32) -> Head {
    Head { kind: 1, shape, rows, frame_ns: 100_000, origin: -100, ..Head::NONE }
}

/// A step of an array of 3 by 3, written out by hand.
#[rustfmt::skip]
const STEP: [u8; 64] = [
    0x10, 0x27, 0, 0,  0x20, 0x4e, 0, 0,               // frames 10,000 to 20,000
    0x9c, 0xff, 0xff, 0xff,  0x84, 0x03, 0, 0,          // counts -100 to 900
    0x2c, 0x01,  1,  0,                                 // 300 frames, back
    0x18, 0xfc,  0xa6, 0x0b,                            // -1,000 mV, 298.2 K
    0x00, 0x04,  0x01, 0x04,  0x00, 0x00,  0x00, 0x84,  // means: 0, 1/8, -128, 4,096 codes
    0xff, 0xff,  0x00, 0x04,  0x00, 0x04,  0x00, 0x04,  0x00, 0x04,
    0, 1, 8, 17, 255, 32, 33, 0, 0,                     // deviations
    0b0000_0101, 0b1,                                   // taxels 0, 2 and 8 are bad
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
];

#[test]
fn a_step_is_read_as_it_was_written() {
    let body = &STEP[..step_bytes(9)];
    assert_eq!(body.len(), 56);
    let read = press(&sealed(&press_head([3, 3], 1), body), PARAMS).expect("a press");
    let [step] = read.steps.as_slice() else { panic!("{} steps", read.steps.len()) };
    close(step.time_s[0], 1.0);
    close(step.time_s[1], 2.0);
    close(step.travel_mm[0], 0.0);
    close(step.travel_mm[1], 1000.0 * crate::mm_per_count());
    assert_eq!((step.frames, step.branch), (300, Branch::Unloading));
    close(step.chip_c.expect("a temperature"), 298.2 - 273.15);
    let means = [0.0, 0.125, -128.0, 4096.0, 8063.875, 0.0, 0.0, 0.0, 0.0];
    // 1, 2 and 4 (1/4 code)^2 and 4.5 of them, cut to 4; the largest is 15/8 of 2^31.
    let deviations = [0.0, 0.25, 0.25 * 2f64.sqrt(), 0.25 * 4f64.sqrt(), 0.25 * (15.0 / 8.0 * 2f64.powi(31)).sqrt()];
    for (taxel, (mean, deviation)) in step.taxels.iter().zip(means.into_iter().zip(deviations)) {
        close(taxel.mean, mean);
        close(taxel.deviation, deviation);
    }
    close(step.taxels[5].deviation, 1.0);
    close(step.taxels[6].deviation, 0.25 * 18f64.sqrt());
    let bad: Vec<usize> = (0..9).filter(|taxel| step.taxels[*taxel].bad).collect();
    assert_eq!(bad, [0, 2, 8]);
    close(read.array.pitch_mm, 1.5);
    close(read.array.codes_per_kpa, 24.0);
    close(read.radius_mm, 10.0);
}

#[test]
fn strokes_are_read_as_they_were_written() {
    let body = [0, 0x80, 0, 0, 5, 0, 0xa0, 0x0f, 0xfe, 0xff, 0x60, 0xf0, 0, 0x80, 0, 0, 7, 0, 0, 0];
    let (ended, value) = (Reason::Touched, 40);
    let record = strokes(&sealed(&Head { ended, value, ..strokes_head(5) }, &body), PARAMS).expect("strokes");
    let samples = |stroke: usize| record.strokes[stroke].samples.iter().map(|one| (one.count, one.voltage_v));
    assert_eq!(record.strokes.len(), 2);
    assert_eq!(samples(0).collect::<Vec<_>>(), [(5, 1.0), (-2, -1.0)]);
    assert_eq!(samples(1).collect::<Vec<_>>(), [(7, 0.0)]);
    assert_eq!(record.ended, Some(Ended { reason: ended, value }));
    close(record.sample_s, 8e-4);
    close(record.delay_s, 4e-5);
    close(record.counts_per_turn, 1600.0);
    close(record.rad_per_mm, 3.583);
    close(record.resistance.value, 3.53);
    // What the chip clipped is no sample.
    for clipped in [[0xff, 0x7f, 0, 0], [0x01, 0x80, 0, 0], [0, 0, 0xff, 0x7f], [0, 0, 0x01, 0x80]] {
        let read = strokes(&sealed(&strokes_head(2), &[[0, 0x80, 0, 0], clipped].concat()), PARAMS);
        assert!(matches!(read, Err(NoRecord::Clipped(1, ..))), "{read:?}");
    }
}

/// FNV-1a by its published test vectors.
#[test]
fn the_check_is_fnv_1a() {
    assert_eq!([check(b""), check(b"a"), check(b"foobar")], [0x811c_9dc5, 0xe40c_292c, 0xbf9c_f968]);
}

#[test]
fn every_fault_of_a_series_is_named() {
    let body = &STEP[..56];
    let good = sealed(&press_head([3, 3], 1), body);
    let changed = |at: usize, byte: u8| {
        let mut bytes = good.clone();
        bytes[at] = byte;
        press(&bytes, PARAMS).expect_err("a fault")
    };
    // A body with a changed byte whose check is right.
    let wrong = |at: usize, byte: u8| {
        let mut body = body.to_vec();
        body[at] = byte;
        press(&sealed(&press_head([3, 3], 1), &body), PARAMS).expect_err("a fault")
    };
    let no_time = Head { frame_ns: 0, ..press_head([3, 3], 1) };
    let faults = [
        (press(&good[..31], PARAMS).unwrap_err(), NoRecord::Short(31)),
        (changed(0, b'X'), NoRecord::Magic(*b"XTS")),
        (changed(3, 2), NoRecord::Version(2)),
        (changed(4, 2), NoRecord::Kind(Kind::Press, 2)),
        (strokes(&good, PARAMS).unwrap_err(), NoRecord::Kind(Kind::Strokes, 1)),
        (changed(5, 0), NoRecord::Shape(0, 3)),
        (changed(7, 14), NoRecord::Reason(14)),
        (press(&good[..87], PARAMS).unwrap_err(), NoRecord::Length(88, 87)),
        (changed(11, 255), NoRecord::Length(32 + 56 * 0xff00_0001, 88)),
        (changed(40, 1), NoRecord::Check(check(body), check(&[&body[..8], &[1], &body[9..]].concat()))),
        (press(&sealed(&no_time, body), PARAMS).unwrap_err(), NoRecord::FrameTime),
        (wrong(2, 1), NoRecord::Order(0)),
        (press(&sealed(&press_head([3, 3], 2), &[body, body].concat()), PARAMS).unwrap_err(), NoRecord::Order(1)),
        (wrong(18, 2), NoRecord::Branch(0, 2)),
        (strokes(&sealed(&strokes_head(1), &[5, 0, 0, 0]), PARAMS).unwrap_err(), NoRecord::Stroke(0)),
        (strokes(&sealed(&strokes_head(2), &[0, 128, 0, 0, 0, 128, 1, 0]), PARAMS).unwrap_err(), NoRecord::Stroke(1)),
    ];
    for (found, expected) in faults {
        assert_eq!(found, expected);
    }
    let mut still = body.to_vec();
    still[16..18].fill(0);
    assert_eq!(press(&sealed(&press_head([3, 3], 1), &still), PARAMS), Err(NoRecord::Frames(0)));
    let params = Params { encoder_counts_per_turn: 0, ..Params::DEFAULT };
    assert!(matches!(press(&good, &params), Err(NoRecord::Params(_))));
    // A press that the chip ended early gives the chip's reason.
    let head = Head { ended: Reason::NoContact, value: 3000, ..press_head([3, 3], 1) };
    let refused = modulus(&[press(&sealed(&head, body), PARAMS).expect("a press")]).expect_err("no modulus");
    assert_eq!(
        refused.to_string(),
        "the press was ended early: the tip met nothing within 3.00 mm: bring the plate nearer, or push the tip back"
    );
}

// A press of the core with wrong numbers in any place, under a right check.
sim::sizes!(a_press_with_changed_bytes_is_solved_or_refused, changed_bytes(&[4]), changed_bytes(&[1, 7]));

fn changed_bytes(seeds: &[u64]) {
    let mut bench: Bench = Bench::default();
    bench.tare();
    bench.run(0.05);
    bench.measure(Task::Press, |_| {});
    let bytes = bench.kept();
    let length = step_bytes(100);
    let records = ((bytes.len() - HEAD) / length) as u32;
    assert!(modulus(&[press(bytes, PARAMS).expect("a press")]).is_ok());
    for &seed in seeds {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut body = bytes[HEAD..].to_vec();
        for _ in 0..10 << seed {
            // The frames' numbers and the branch stay, or the series would be refused before.
            let at = length * rng.usize(..records as usize) + rng.usize(8..length);
            if !(16..20).contains(&(at % length)) {
                body[at] = rng.u8(..);
            }
        }
        let read = press(&sealed(&press_head([10, 10], records), &body), PARAMS);
        assert!(read.is_ok(), "{read:?}");
        solved(read);
    }
}

/// Solves what can be read of a press: the result does not matter, a panic would.
fn solved(read: Result<Press, NoRecord>) {
    if let Ok(read) = read {
        drop(gains(&[read.clone(), read.clone()]));
        drop(modulus(&[read]).map(|found| found.to_string()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn a_cut_or_changed_series_is_refused(at in 0usize..88, bit in 0u8..8) {
        let good = sealed(&press_head([3, 3], 1), &STEP[..56]);
        prop_assert!(press(&good[..at], PARAMS).is_err());
        let mut changed = good.clone();
        changed[at] ^= 1 << bit;
        let read = press(&changed, PARAMS);
        // Only the reason, the frame time, the origin, the delay and the number in the head may be any.
        prop_assert_eq!(read.is_err(), !matches!(at, 7 | 16..HEAD) || (at == 7 && 1 << bit > 13), "{:?}", read);
    }

}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    /// Any numbers in a series whose lengths and check are right.
    #[test]
    fn any_numbers_are_solved_or_refused(
        rows in 1u8..7,
        columns in 1u8..7,
        origin in any::<i32>(),
        frames in prop::collection::vec((1u32..5_000, 0u32..500, any::<[i32; 2]>(), any::<bool>()), 0..12),
        noise in prop::collection::vec(any::<u8>(), 1..300),
        calm in any::<bool>(),
    ) {
        let length = step_bytes(usize::from(rows) * usize::from(columns));
        let (mut body, mut time) = (Vec::new(), 0);
        for (index, (pause, frame, counts, back)) in frames.iter().enumerate() {
            let end = body.len() + length;
            for frame in [time + pause, time + pause + frame] {
                body.extend(frame.to_le_bytes());
            }
            time += pause + frame;
            for count in counts {
                let count = if calm { origin.wrapping_add(count % 3000) } else { *count };
                body.extend(count.to_le_bytes());
            }
            body.extend([1, 0, u8::from(*back), 0]);
            body.extend(noise.iter().cycle().skip(index).take(end - body.len()));
        }
        let head = Head { origin, ..press_head([rows, columns], frames.len() as u32) };
        let read = press(&sealed(&head, &body), PARAMS);
        prop_assert!(read.is_ok(), "{read:?}");
        solved(read);
    }

    #[test]
    fn any_samples_are_solved_or_refused(
        strokes_counts in prop::collection::vec((prop::collection::vec(any::<[i16; 2]>(), 0..60), any::<bool>()), 0..10),
    ) {
        let mut body = Vec::new();
        for (samples, calm) in &strokes_counts {
            body.extend([0, 0x80, 0, 0]);
            for (at, [count, voltage]) in samples.iter().enumerate() {
                let count = if *calm { at as i16 * 20 + count % 30 } else { (*count).clamp(-32_766, 32_766) };
                body.extend(count.to_le_bytes());
                body.extend((*voltage).clamp(-32_766, 32_766).to_le_bytes());
            }
        }
        let record = strokes(&sealed(&strokes_head((body.len() / 4) as u32), &body), PARAMS).expect("strokes");
        let _ = solve::strokes::solve(&record);
    }
}
