//! Captures in the core: kept frames come back to the bit, damage is reported, and a replay finds differences.

use crate::common::*;
use fingertip::capture::{Ended, Head, digest_words};
use fingertip::shipped::Gains;
use replay::{ReplayError, replay};

// A finger that is captured from its tare on.

type Burst<const BYTES: usize> = Capture<ROWS, COLUMNS, BYTES>;

impl<const BYTES: usize> Recorded<BYTES> {
    /// 0.4 mm from the wall, with gains that differ.
    fn new() -> Self {
        let mut setup = Setup::default();
        setup.wall.distance_mm = 0.4;
        let mut finger = Self::of(&setup, &config());
        finger.bench.pipeline().calibrate(&Calibration::of(&gains()));
        finger
    }

    /// Arms, tares, touches and holds until the memory is full.
    fn press(&mut self) {
        self.capture.arm();
        self.bench.command().tare_request += 1;
        self.frame();
        self.bench.command().torque = true;
        self.bench.command().goal = newtons(800);
        while self.capture.standing().state == CaptureState::Recording {
            self.frame();
        }
        assert_eq!(self.capture.standing().ended, Ended::Full, "{}", told(&mut self.bench));
    }

    /// A fresh finger that records from its tare on.
    fn armed() -> Self {
        let mut finger = Self::new();
        finger.capture.arm();
        finger.bench.command().tare_request += 1;
        finger
    }

    /// A press of a fresh finger.
    fn pressed() -> Self {
        let mut finger = Self::new();
        finger.press();
        finger
    }
}

/// Of all sizes.
fn gains() -> Gains {
    let mut gains = Gains::ONE;
    for place in 0..TAXELS {
        assert!(gains.set(place, GAIN_ONE - 1_000 + 20 * place as u16));
    }
    gains
}

/// A capture that records from the next frame on.
fn recording<const BYTES: usize>() -> Box<Burst<BYTES>> {
    let mut capture = Box::new(Burst::NEW);
    capture.arm();
    capture.begin(&mut Pipeline::new(&config()));
    capture
}

// Whatever frames hold, they come back.

const CODED_BYTES: usize = 8 << 10;

/// A step's arguments and answer, by how far they may stray from frame to frame.
fn step(spread: u16) -> impl Strategy<Value = (Record, Status)> {
    let codes = prop::collection::vec(0..=spread, SLOTS * COLUMNS);
    let bytes = prop::collection::vec(any::<u8>(), Record::BYTES);
    let wild = (any::<bool>(), any::<bool>(), any::<bool>(), any::<bool>());
    let answer = (any::<i16>(), any::<bool>(), any::<bool>(), any::<u32>());
    (codes, bytes, wild, answer).prop_map(move |(codes, bytes, wild, (duty, force, faulted, sequence))| {
        let mut frame = Frame { sequence, ..Frame::EMPTY };
        for (place, code) in codes.into_iter().enumerate() {
            frame.set_code(place / COLUMNS, place % COLUMNS, code);
        }
        // Any sense and command; their truth values and the fit level come apart from their bytes.
        let Record { sense, command, .. } = Record::from_bytes(&bytes.try_into().expect("the bytes of a record"));
        let (wild_sense, wild, torque, tare_forced) = wild;
        let chip = sense.chip.filter(|_| sense.answer.0.is_multiple_of(2));
        let sense = if wild_sense {
            Sense { chip, bridge_fault: sense.answer.0 % 4 < 2, ..sense }
        } else {
            Sense { encoder: sense.encoder & 3, supply_mv: 6_000 | sense.supply_mv & 7, ..Sense::default() }
        };
        let fit_level = FitLevel::from_number(command.tare_request % 6);
        let command = Command { torque, fit_level, tare_forced, ..command };
        let mode = if force { Mode::Force } else { Mode::Fault };
        let fault = faulted.then_some(Fault::BrownOutLevel);
        let status = Status { duty: Duty(duty), mode, fault, ..Status::default() };
        (Record { frame, sense, command: if wild { command } else { Command::default() } }, status)
    })
}

fn steps() -> impl Strategy<Value = Vec<(Record, Status)>> {
    let spread = prop_oneof![Just(2_u16), Just(40), Just(4_095), Just(u16::MAX)];
    prop::collection::vec(spread.prop_flat_map(step), 1..30)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_frame_comes_back_to_the_bit(steps in steps()) {
        let (mut capture, mut kept) = (recording::<CODED_BYTES>(), 0);
        for (Record { frame, sense, command }, status) in &steps {
            capture.record(frame, sense, command, status);
            kept += usize::from(capture.standing().state == CaptureState::Recording);
        }
        capture.end(Ended::Asked);
        let (head, frames) = replay::frames::<ROWS, COLUMNS>(capture.data()).expect("a capture");
        prop_assert_eq!(head.frames as usize, kept);
        prop_assert!(kept == steps.len() || head.ended == Ended::Full);
        let frames: Vec<_> = frames.collect::<Result<_, _>>().expect("every frame");
        prop_assert_eq!(frames.len(), kept);
        for (taken, (record, status)) in frames.iter().zip(&steps) {
            prop_assert_eq!(Record { frame: taken.frame, sense: taken.sense, command: taken.command }, *record);
            let fault = status.fault.map_or(0, |fault| fault as u8);
            prop_assert_eq!((taken.duty, taken.mode, taken.fault), (status.duty, status.mode as u8, fault));
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..900), real in any::<bool>()) {
        let mut bytes = bytes;
        if real {
            let mut capture = recording::<CODED_BYTES>();
            capture.end(Ended::Asked);
            let mut head = capture.data().to_vec();
            let bits = 8 * bytes.len() as u32;
            head[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
            head[16..20].copy_from_slice(&bits.to_le_bytes());
            // The check sum is right, so that the frames are reached.
            let words = [&bytes[..], &[0; 4]].concat();
            let words = words.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word));
            head[24..28].copy_from_slice(&digest_words(0, words).to_le_bytes());
            bytes = [head, bytes].concat();
        }
        let read = replay::frames::<ROWS, COLUMNS>(&bytes);
        prop_assert_eq!(read.is_ok(), real);
        if let Ok((_, frames)) = read {
            prop_assert!(frames.filter(Result::is_err).count() <= 1);
        }
    }
}

#[test]
fn out_of_turn_nothing_is_kept() {
    let mut pipeline = Pipeline::new(&config());
    let mut capture = Box::new(Burst::<CODED_BYTES>::NEW);
    let (status, tare) = (Status::default(), Command { tare_request: 1, ..Command::default() });
    assert!(!capture.is_due(&pipeline, &tare), "nobody armed it");
    capture.end(Ended::Asked);
    capture.record(&Frame::EMPTY, &Sense::default(), &tare, &status);
    assert_eq!((capture.standing(), capture.data()), (Default::default(), &[][..]));
    capture.arm();
    capture.arm();
    assert_eq!(capture.standing().state, CaptureState::Armed);
    assert!(!capture.is_due(&pipeline, &Command::default()), "nobody tares");
    let mut stopped = pipeline.clone();
    stopped.stop(Fault::LostFrames);
    assert!(!capture.is_due(&stopped, &tare), "a fault refuses a tare");
    assert!(capture.is_due(&pipeline, &tare));
    // New parameters do not call it off, the host does.
    capture.end(Ended::Configured);
    assert_eq!(capture.standing().state, CaptureState::Armed);
    capture.end(Ended::Asked);
    assert_eq!(capture.standing().state, CaptureState::None);
    capture.arm();
    capture.begin(&mut pipeline);
    capture.record(&Frame::EMPTY, &Sense::default(), &tare, &status);
    capture.arm();
    assert_eq!((capture.standing().state, capture.standing().frames), (CaptureState::Recording, 1), "armed twice");
    assert!(capture.data().is_empty(), "it is not done");
    capture.end(Ended::Stopped);
    capture.end(Ended::Asked);
    let standing = capture.standing();
    assert_eq!((standing.state, standing.ended, standing.count), (CaptureState::Done, Ended::Stopped, 1));
    assert_eq!(capture.data().len(), standing.bytes as usize);
    capture.arm();
    assert!(capture.data().is_empty());
}

/// As `docs/captures.md` has it.
#[test]
fn a_frame_takes_what_its_noise_says() {
    let mut rng = Rng::with_seed(1);
    for (noise, most) in [(0.0, 20.0), (0.5, 33.0), (1.0, 46.0), (2.0, 62.0)] {
        let mut capture = recording::<{ 44 << 10 }>();
        let mut frame = Frame::EMPTY;
        while capture.standing().state == CaptureState::Recording {
            frame.sequence += 1;
            for place in 0..SLOTS * COLUMNS {
                let code = 372.3 + noise * normal(&mut rng);
                frame.set_code(place / COLUMNS, place % COLUMNS, code.round() as u16);
            }
            let supply_mv = 6_000 + rng.u16(..4);
            let sense = Sense { supply_mv, answer: CoreCycles(5_000), ..Sense::default() };
            capture.record(&frame, &sense, &Command::default(), &Status::default());
        }
        let frames = capture.standing().frames;
        let each = capture.data().len() as f64 / f64::from(frames);
        println!("| {noise} | {each:.0} bytes | {frames} | {:.0} ms |", f64::from(frames) / 10.0);
        assert!(each < most, "{each} bytes at {noise} codes");
    }
}

// A capture that is not as the board wrote it: refused, or found to differ; never taken.

const DAMAGED_BYTES: usize = 1 << 10;

fn verdict(bytes: &[u8]) -> Result<bool, ReplayError> {
    replay::<ROWS, COLUMNS>(bytes, &CLOCKS, |_, _| {}).map(|replayed| replayed.difference.is_none())
}

#[test]
fn every_bit_and_every_length_counts() {
    let finger = Recorded::<DAMAGED_BYTES>::pressed();
    let mut bytes = finger.capture.data().to_vec();
    assert_eq!(verdict(&bytes), Ok(true));
    for place in 0..bytes.len() {
        assert_eq!(verdict(&bytes[..place]), Err(ReplayError::Cut), "{place} bytes");
        for bit in 0..8 {
            bytes[place] ^= 1 << bit;
            assert_ne!(verdict(&bytes), Ok(true), "bit {bit} of byte {place}");
            bytes[place] ^= 1 << bit;
        }
    }
    assert_eq!(verdict(&[&bytes[..], &[0]].concat()), Err(ReplayError::Longer));
}

#[test]
fn others_are_told_apart() {
    let finger = Recorded::<DAMAGED_BYTES>::pressed();
    let changed = |place: usize, value: u8| {
        let mut bytes = finger.capture.data().to_vec();
        bytes[place] = value;
        verdict(&bytes)
    };
    assert_eq!(changed(0, b'X'), Err(ReplayError::NoCapture));
    assert_eq!(changed(3, 1), Err(ReplayError::Version(1)));
    assert_eq!(changed(4, 8), Err(ReplayError::Shape { rows: 8, columns: 10 }));
    assert_eq!(changed(6, Ended::No as u8), Err(ReplayError::Unfinished));
    assert_eq!(changed(8, 0), Err(ReplayError::Layout));
    let slower = Clocks { timer_hz: CLOCKS.timer_hz / 2, core_hz: CLOCKS.core_hz / 2, ..CLOCKS };
    let slower = Box::leak(Box::new(slower));
    let refusal = replay::<ROWS, COLUMNS>(finger.capture.data(), slower, |_, _| {});
    assert!(matches!(refusal, Err(ReplayError::FrameTime { .. })), "{refusal:?}");
    for refusal in [ReplayError::Layout, ReplayError::Cut, ReplayError::Version(2), ReplayError::Frame(7)] {
        assert!(refusal.to_string().contains("capture"), "{refusal}");
    }
}

// A replay from the parameters, the gains and the frames alone.

const BYTES: usize = 44 << 10;

/// Replays a capture without a difference; its head.
fn agrees<const BYTES: usize>(finger: &Recorded<BYTES>, mut each: impl FnMut(&Status)) -> Head<ROWS, COLUMNS> {
    let replayed = replay(finger.capture.data(), &CLOCKS, |_, status| each(status)).expect("a capture");
    assert_eq!(replayed.difference, None);
    replayed.head
}

#[test]
fn a_press_replays_to_the_bit_also_with_gains() {
    let finger = Recorded::<BYTES>::pressed();
    let (mut modes, mut force_n) = (Vec::new(), 0.0);
    let head = agrees(&finger, |status| {
        modes.push(status.mode);
        force_n = status.contact.force.0.to_num::<f64>();
    });
    assert_eq!((head.ended, head.gains), (Ended::Full, gains()));
    modes.dedup();
    assert_eq!(modes, [Mode::Tare, Mode::Off, Mode::Approach, Mode::Force], "a press is in it");
    assert!((force_n - 0.8).abs() < 0.1, "{force_n} N");
    assert!(head.frames > TARE_FRAMES + 600, "{} frames", head.frames);
}

/// Only the warmth of the motor goes on.
#[test]
fn what_the_finger_did_before_does_not_matter() {
    let mut finger = Recorded::<{ 8 << 10 }>::new();
    finger.bench.tare();
    finger.bench.command().goal = newtons(6_000);
    finger.bench.frames(5_000);
    finger.bench.request(Task::Press);
    finger.bench.frames(3_000);
    finger.bench.command().goal = newtons(0);
    finger.bench.frames(3_000);
    finger.bench.step_with(|record| record.sense.bridge_fault = true);
    assert_eq!(finger.bench.status().fault, Some(Fault::Bridge));
    *finger.bench.command() = Command { torque: false, clear_request: 1, ..*finger.bench.command() };
    finger.bench.frames(500);
    for _ in 0..2 {
        *finger.bench.command() = Command { torque: true, goal: newtons(0), ..*finger.bench.command() };
        finger.frames(3_000);
        finger.bench.command().torque = false;
        finger.frames(300);
        let before: f64 = finger.bench.status().winding.0.to_num();
        assert!(before > 88.5, "{before} C: it is warmer than after a reset");
        finger.press();
        let mut coldest = f64::MAX;
        agrees(&finger, |status| coldest = coldest.min(status.winding.0.to_num()));
        assert!(coldest > before - 0.1, "{coldest} C after {before} C");
    }
    assert_eq!(finger.capture.standing().count, 2);
}

/// The old zero remains, and the motor is shorted until the tip rests. A forced tare begins the capture while the tip still
/// moves: it is braked on.
#[test]
fn a_capture_does_not_let_a_moving_tip_go_and_a_tare_under_load_is_refused_to_it_too() {
    let mut finger = Recorded::<BYTES>::new();
    finger.bench.tare();
    finger.bench.command().goal = newtons(4_000);
    finger.frames(5_000);
    finger.bench.command().torque = false;
    finger.frame();
    finger.capture.arm();
    for (tare_forced, mode, tare, state) in [
        (false, Mode::Off, Taring::Refused, CaptureState::Armed),
        (true, Mode::Tare, Taring::Running, CaptureState::Recording),
    ] {
        let command = finger.bench.command();
        command.tare_forced = tare_forced;
        command.tare_request += 1;
        let status = finger.frame();
        assert_eq!((status.mode, status.tare, status.bridge()), (mode, tare, Bridge::Brakes));
        assert_eq!(finger.capture.standing().state, state);
    }
}

/// Torque that comes with the tare is newer than the capture's beginning.
#[test]
fn torque_that_comes_before_the_first_kept_step_is_taken() {
    let mut finger = Recorded::<BYTES>::armed();
    *finger.bench.command() = Command { torque: true, goal: newtons(800), ..*finger.bench.command() };
    finger.frames(TARE_FRAMES + 10);
    let status = finger.frame();
    assert_eq!((status.mode, status.limits.has(Limits::TORQUE_HELD)), (Mode::Approach, false));
}

#[test]
fn a_fault_is_in_it_and_what_comes_after() {
    let mut finger = Recorded::<BYTES>::armed();
    finger.frames(300);
    finger.bench.command().torque = true;
    finger.bench.command().goal = newtons(500);
    finger.frames(100);
    (0..5).for_each(|_| _ = finger.frame_with(|record| record.sense.supply_mv = 0));
    finger.frames(20);
    assert_eq!(finger.bench.status().fault, Some(Fault::SupplyLow));
    finger.capture.end(Ended::Asked);
    assert_eq!(agrees(&finger, |_| {}).frames, 425);
    // An action on the loop between steps ends the capture; the frames before it replay.
    let mut finger = Recorded::<BYTES>::armed();
    finger.frames(200);
    finger.bench.pipeline().stop(Fault::LostFrames);
    finger.capture.end(Ended::Stopped);
    finger.frames(20);
    assert_eq!(finger.capture.standing().state, CaptureState::Done);
    assert_eq!(agrees(&finger, |_| {}).frames, 200);
}

#[test]
fn another_parameter_or_a_step_that_answers_otherwise_is_found_where_it_is() {
    let difference = |bytes: &[u8]| {
        replay::<ROWS, COLUMNS>(bytes, &CLOCKS, |_, _| {}).expect("a capture").difference.expect("a difference")
    };
    let mut bytes = Recorded::<BYTES>::pressed().capture.data().to_vec();
    // The modulus changes no result before a contact, but the digest starts from all parameters.
    let place = Params::RANGES.iter().position(|(name, ..)| *name == "modulus_pa").expect("a parameter");
    bytes[72 + 4 * place] ^= 1;
    let found = difference(&bytes);
    assert_eq!((found.frame, found.field), (0, "digest"));
    let told = found.to_string();
    assert!(told.contains("frame 0: digest captured") && told.contains("replayed"), "{told}");

    // A duty that is one more than the core's.
    let mut finger = Recorded::<BYTES>::armed();
    finger.bench.command().fit_level = FitLevel::TwoRows;
    finger.frames(20);
    let mut status = *finger.bench.status();
    status.duty.0 += 1;
    let given = finger.bench.record();
    finger.capture.record(&given.frame, &given.sense, &given.command, &status);
    finger.capture.end(Ended::Asked);
    let found = difference(finger.capture.data());
    assert_eq!((found.frame, found.field), (20, "duty"));
}
