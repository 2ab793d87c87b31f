//! Whatever frames hold, they come back.

use super::burst::Burst;
use fingertip::capture::{Ended, State};
use fingertip::command::Command;
use fingertip::contact::FitLevel;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, Pipeline, ROWS, SLOTS};
use fingertip::state::{Fault, Mode};
use fingertip::units::{Celsius, CoreCycles, Duty, Newtons};
use host_tests::finger::config;
use proptest::prelude::*;
use replay::Frames;

const BYTES: usize = 8 << 10;

/// A step's arguments and answer, by how far they may stray from frame to frame.
#[derive(Clone, Debug)]
struct Step {
    frame: Frame,
    sense: Sense,
    command: Command,
    status: Status,
}

fn step(spread: u16) -> impl Strategy<Value = Step> {
    let codes = prop::collection::vec(0..=spread, SLOTS * COLUMNS);
    let sense = (any::<i32>(), any::<u16>(), any::<u16>(), any::<bool>(), any::<u32>(), any::<bool>());
    let command = (any::<[u8; 3]>(), any::<[bool; 2]>(), any::<i32>(), any::<u16>(), 0..6_u8, any::<bool>());
    let answer = (any::<i16>(), any::<bool>(), any::<bool>(), any::<u32>());
    (codes, sense, command, answer).prop_map(move |(codes, sense, command, (duty, force, faulted, sequence))| {
        let mut frame = Frame { sequence, ..Frame::EMPTY };
        for (place, code) in codes.into_iter().enumerate() {
            frame.set_code(place / COLUMNS, place % COLUMNS, code);
        }
        let (encoder, supply_mv, bus_silent_ms, bridge_fault, answer, wild) = sense;
        let sense = if wild {
            let chip = answer.is_multiple_of(2).then_some(Celsius::from_bits(encoder.rotate_left(9)));
            Sense { encoder, supply_mv, bus_silent_ms, bridge_fault, chip, answer: CoreCycles(answer) }
        } else {
            Sense { encoder: encoder & 3, supply_mv: 6_000 | supply_mv & 7, ..Sense::default() }
        };
        let ([tare, clear, measure], bools, goal, watchdog, level, wild) = command;
        let [torque, tare_forced] = bools;
        let command = Command {
            torque,
            goal: Newtons::from_bits(goal),
            bus_watchdog_ms: watchdog,
            fit_level: FitLevel::from_number(level),
            tare_request: tare,
            tare_forced,
            clear_request: clear,
            measure_request: measure,
        };
        let status = Status {
            duty: Duty(duty),
            mode: if force { Mode::Force } else { Mode::Fault },
            fault: faulted.then_some(Fault::BrownOutLevel),
            ..Status::default()
        };
        Step { frame, sense, command: if wild { command } else { Command::default() }, status }
    })
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let spread = prop_oneof![Just(2_u16), Just(40), Just(4_095), Just(u16::MAX)];
    prop::collection::vec(spread.prop_flat_map(step), 1..30)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_frame_comes_back_to_the_bit(steps in steps()) {
        let mut pipeline = Pipeline::new(&config());
        let mut capture = Box::new(Burst::<BYTES>::NEW);
        capture.arm();
        capture.begin(&mut pipeline);
        let mut kept = 0;
        for step in &steps {
            capture.record(&step.frame, &step.sense, &step.command, &step.status);
            kept += usize::from(capture.standing().state == State::Recording);
        }
        capture.end(Ended::Asked);
        let (head, frames) = Frames::<ROWS, COLUMNS>::new(capture.data()).expect("a capture");
        prop_assert_eq!(head.frames as usize, kept);
        prop_assert!(kept == steps.len() || head.ended == Ended::Full);
        let frames: Vec<_> = frames.collect::<Result<_, _>>().expect("every frame");
        prop_assert_eq!(frames.len(), kept);
        for (taken, step) in frames.iter().zip(&steps) {
            prop_assert_eq!(&taken.frame, &step.frame);
            prop_assert_eq!(taken.sense, step.sense);
            prop_assert_eq!(taken.command, step.command);
            prop_assert_eq!(taken.duty, step.status.duty);
            let fault = step.status.fault.map_or(0, |fault| fault as u8);
            prop_assert_eq!((taken.mode, taken.fault), (step.status.mode as u8, fault));
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..900), real in any::<bool>()) {
        let mut bytes = bytes;
        if real {
            let mut pipeline = Pipeline::new(&config());
            let mut capture = Box::new(Burst::<BYTES>::NEW);
            capture.arm();
            capture.begin(&mut pipeline);
            capture.end(Ended::Asked);
            let mut head = capture.data().to_vec();
            let bits = 8 * bytes.len() as u32;
            head[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
            head[16..20].copy_from_slice(&bits.to_le_bytes());
            head[24..28].copy_from_slice(&check(&bytes).to_le_bytes());
            bytes = [head, bytes].concat();
        }
        let read = Frames::<ROWS, COLUMNS>::new(&bytes);
        prop_assert_eq!(read.is_ok(), real);
        if let Ok((_, frames)) = read {
            prop_assert!(frames.filter(Result::is_err).count() <= 1);
        }
    }
}

/// As the board's, so that the frames are reached.
fn check(bytes: &[u8]) -> u32 {
    let padded = [bytes, &vec![0; 4 - bytes.len() % 4]].concat();
    let words = padded.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")));
    words.fold(0, |check: u32, word| (check.rotate_left(5) ^ word).wrapping_mul(0x9E37_79B1))
}

#[test]
fn out_of_turn_nothing_is_kept() {
    let config = config();
    let mut pipeline = Pipeline::new(&config);
    let mut capture = Box::new(Burst::<BYTES>::NEW);
    let (status, tare) = (Status::default(), Command { tare_request: 1, ..Command::default() });
    assert!(!capture.is_due(&status, &tare), "nobody armed it");
    capture.end(Ended::Asked);
    capture.record(&Frame::EMPTY, &Sense::default(), &tare, &status);
    assert_eq!((capture.standing(), capture.data()), (Default::default(), &[][..]));
    capture.arm();
    capture.arm();
    assert_eq!(capture.standing().state, State::Armed);
    assert!(!capture.is_due(&status, &Command::default()), "nobody tares");
    for mode in [Mode::Fault, Mode::Force, Mode::Tare] {
        assert!(!capture.is_due(&Status { mode, ..status }, &tare), "{mode:?}");
    }
    assert!(capture.is_due(&status, &tare));
    // New parameters do not call it off, the host does.
    capture.end(Ended::Configured);
    assert_eq!(capture.standing().state, State::Armed);
    capture.end(Ended::Asked);
    assert_eq!(capture.standing().state, State::None);
    capture.arm();
    capture.begin(&mut pipeline);
    capture.record(&Frame::EMPTY, &Sense::default(), &tare, &status);
    capture.arm();
    assert_eq!((capture.standing().state, capture.standing().frames), (State::Recording, 1), "armed twice");
    assert!(capture.data().is_empty(), "it is not done");
    capture.end(Ended::Stopped);
    capture.end(Ended::Asked);
    let standing = capture.standing();
    assert_eq!((standing.state, standing.ended, standing.count), (State::Done, Ended::Stopped, 1));
    assert_eq!(capture.data().len(), standing.bytes as usize);
    capture.arm();
    assert!(capture.data().is_empty());
}

/// As `docs/captures.md` has it.
#[test]
fn a_frame_takes_what_its_noise_says() {
    let config = config();
    let mut state = 1_u32;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    for (noise, most) in [(0.0, 20.0), (0.5, 33.0), (1.0, 46.0), (2.0, 62.0)] {
        let mut pipeline = Pipeline::new(&config);
        let mut capture = Box::new(Burst::<{ 44 << 10 }>::NEW);
        capture.arm();
        capture.begin(&mut pipeline);
        let mut frame = Frame::EMPTY;
        while capture.standing().state == State::Recording {
            frame.sequence += 1;
            for place in 0..SLOTS * COLUMNS {
                // Twelve of them make a normal number.
                let normal: f64 = (0..12).map(|_| uniform()).sum();
                frame.set_code(place / COLUMNS, place % COLUMNS, (372.3 + noise * normal).round() as u16);
            }
            let sense =
                Sense { supply_mv: 6_000 + (8.0 * uniform()) as u16, answer: CoreCycles(5_000), ..Sense::default() };
            capture.record(&frame, &sense, &Command::default(), &Status::default());
        }
        let frames = capture.standing().frames;
        let each = capture.data().len() as f64 / f64::from(frames);
        println!("| {noise} | {each:.0} bytes | {frames} | {:.0} ms |", f64::from(frames) / 10.0);
        assert!(each < most, "{each} bytes at {noise} codes");
    }
}
