//! Motions that measure: their begin, their end, early or not, and their record.

mod series;

use self::series::head;
use crate::common::*;
use fingertip::capture::Ended as CaptureEnded;
use fingertip::measure::BuiltIn;
use fingertip::measure::press::{HOLDS_MS, PARTS, Press, PressInputs, ROWS_MAX, Step};
use solve::press::{Branch, Press as Pressed};
use solve::record::{NoRecord, press, strokes};

impl<const BYTES: usize> Recorded<BYTES> {
    /// 5 mm from the wall, not tared.
    fn untared() -> Self {
        Self::of(&Setup::default(), &config())
    }

    /// Tared, torque off, the tip at rest.
    fn tared() -> Self {
        let mut finger = Self::untared();
        finger.bench.command().tare_request += 1;
        finger.frames(TARE_FRAMES + 200);
        finger
    }

    /// The motion in its first frame, with the torque that it needs.
    fn begun(task: Task) -> Self {
        let mut finger = Self::tared();
        finger.begin(task);
        finger
    }

    fn begin(&mut self, task: Task) {
        self.bench.command().torque = task == Task::Press;
        self.frames(3_000);
        self.bench.request(task);
        let MeasureStatus { task: begun, state, .. } = self.frame().measure;
        assert_eq!((begun, state), (task, MeasureState::Running));
    }

    /// Steps until the motion ends; its last frame.
    fn ends(&mut self) -> Status {
        let status = (0..400_000).map(|_| self.frame()).find(|status| status.measure.state != MeasureState::Running);
        status.expect("an end")
    }

    /// The record of a press, which must be closed.
    fn recorded_press(&self) -> Pressed {
        press(self.closed(), &images::CONFIRMED).expect("a press")
    }

    fn closed(&self) -> &[u8] {
        assert_eq!(self.capture.standing().state, CaptureState::Done);
        self.capture.data()
    }

    /// The motion and its record have the same end.
    fn assert_ended(&self, task: Task, ended: Ended) {
        let measure = self.bench.status().measure;
        assert_eq!((measure.task, measure.ended), (task, ended), "{measure:?}");
        if task != Task::Jog {
            let kind = if task == Task::Press { 1 } else { 2 };
            assert_eq!(head(self.closed()), (kind, ended as u8, self.capture.standing().frames, measure.value));
        }
    }
}

// What a motion leaves in the memory, and who else wants it.

#[test]
fn a_press_is_recorded_whole() {
    let mut finger = Recorded::<CAPTURE_BYTES>::begun(Task::Press);
    finger.ends();
    finger.assert_ended(Task::Press, Ended::Complete);
    let steps = finger.recorded_press().steps;
    assert!(steps.len() <= ROWS_MAX && steps.len() > 80, "{} rows", steps.len());
    // In and back twice, and a hold without motion.
    assert_eq!(steps.windows(2).filter(|pair| pair[0].branch != pair[1].branch).count(), 3);
    let config = config();
    let rests = |a: f64, b: f64| (a - b).abs() < 20.0 * config.count.0.to_num::<f64>();
    let held = steps.windows(2).filter(|pair| {
        let [begin, end] = pair[1].travel_mm;
        pair[1].branch == Branch::Loading && rests(begin, pair[0].travel_mm[1]) && rests(begin, end)
    });
    let held = held.count();
    assert!(held + 1 >= HOLDS_MS.len(), "{held} rows of a hold");
    for pair in steps.windows(2) {
        // Those in which the step before is handed over are left out.
        let frames = (pair[1].time_s[0] - pair[0].time_s[1]) / frame_s(&config);
        assert!((frames - f64::from(PARTS)).abs() < 1e-3, "{frames} frames");
    }
    let deepest = steps.iter().map(|step| step.taxels.iter().map(|taxel| taxel.mean).sum()).fold(0.0, f64::max);
    assert!(deepest > 1_000.0, "{deepest} codes");
}

#[test]
fn strokes_are_recorded_whole() {
    let mut finger = Recorded::<CAPTURE_BYTES>::begun(Task::Strokes);
    finger.ends();
    finger.assert_ended(Task::Strokes, Ended::Complete);
    let record = strokes(finger.closed(), &images::CONFIRMED).expect("strokes");
    assert!(record.strokes.len() == 32 && (record.delay_s - 33e-6).abs() < 1e-12, "{record:?}");
    assert!(finger.capture.standing().bytes < 40 << 10, "{} bytes", finger.capture.standing().bytes);
}

/// Rows that fit are stored, then the record is closed as full; the motion continues.
#[test]
fn a_memory_that_is_full_keeps_what_it_has() {
    let mut finger = Recorded::<{ 2 << 10 }>::begun(Task::Press);
    assert_eq!(finger.ends().measure.state, MeasureState::Done);
    let standing = finger.capture.standing();
    assert_eq!(head(finger.closed()), (1, Ended::Full as u8, 5, 5));
    assert_eq!(finger.recorded_press().steps.len(), 5);
    assert_eq!((standing.ended, standing.frames), (CaptureEnded::Full, 5));
}

/// Armed: the motion takes the memory. Recording: the frames keep it, and the motion has no record.
#[test]
fn a_capture_and_a_motion_share_the_memory() {
    let mut finger = Recorded::<CAPTURE_BYTES>::tared();
    finger.capture.arm();
    finger.begin(Task::Press);
    finger.capture.arm();
    finger.ends();
    finger.assert_ended(Task::Press, Ended::Complete);

    let mut finger = Recorded::<CAPTURE_BYTES>::tared();
    finger.capture.arm();
    finger.bench.command().tare_request += 1;
    finger.frames(330);
    assert_eq!(finger.capture.standing().state, CaptureState::Recording);
    finger.bench.request(Task::Strokes);
    finger.frames(5);
    assert_eq!(finger.bench.status().measure.state, MeasureState::Running);
    finger.capture.end(CaptureEnded::Asked);
    assert_eq!(finger.capture.data()[..3], *b"FTC");
    let frames = finger.capture.standing().frames;
    assert_eq!(frames, 335);
    finger.ends();
    assert_eq!((finger.capture.standing().frames, finger.capture.standing().count), (frames, 1));
}

// Whatever a press is shown, its record has a bound; whatever a finger is shown, motions neither panic nor overflow.

/// Frames of 83 us to 10 ms, an encoder that moves, jumps or rests, and an intermittent force.
#[test]
fn a_press_has_no_more_rows_than_stated() {
    let mut most = 0;
    for seed in 0..400 {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut config = config();
        config.timing.frame_ns = random.u32(83_000..10_000_000);
        let (mut motion, mut standing) = (SpeedLoop::new(), MeasureStatus::running(Task::Press));
        let (mut step, mut picture) = (Step::<ROWS, COLUMNS>::NONE, TactileImage::EMPTY);
        let mut contact = Contact::default();
        motion.observe(0, &config);
        let mut press =
            Press::begin(&motion, Millimetres::from_bits(-1 << 30), BuiltIn::PROOF.expect("it is built in"));
        let (mut encoder, mut rows, mut sequence) = (0_i32, 0, 0_u32);
        let stride = [3, 60, 600, 40_000][random.usize(0..4)];
        while press.running() && sequence < 40_000 {
            sequence += 1;
            if random.u32(0..40) == 0 {
                contact.force = newtons([0, 50, 2_000][random.usize(0..3)]);
            }
            if random.u32(0..500) == 0 {
                picture.taxels = [[random.i32(-200_000..200_000); COLUMNS]; ROWS];
                picture.bad_count = random.u16(0..2);
            }
            encoder = encoder.wrapping_add(random.i32(-stride..=stride));
            motion.observe(encoder, &config);
            let chip = random.bool().then(|| Celsius::from_bits(random.i32(..)));
            let (picture, contact, motion) = (&picture, &contact, &motion);
            let (applied_mv, lasts) = (random.i32(-20_000..20_000), sequence.is_multiple_of(2));
            let view = PressInputs { sequence, picture, contact, lasts, encoder, motion, applied_mv, chip };
            press.observe(&view, &mut step, &mut standing, &config);
            rows += usize::from(press.part() == Some(0));
        }
        most = most.max(rows);
        assert!(rows <= ROWS_MAX, "seed {seed}: {rows} rows");
        assert_eq!(press.running(), standing.state == MeasureState::Running);
    }
    assert!(most > ROWS_MAX / 2, "{most} rows at most: the inputs show nothing");
}

sim::sizes!(a_motion_takes_anything_and_closes_its_record, take_anything(0..15), take_anything(15..60));

fn take_anything(seeds: Range<u64>) {
    for seed in seeds {
        let mut random = fastrand::Rng::with_seed(seed);
        let task = [Task::Jog, Task::Strokes, Task::Press][seed as usize % 3];
        let mut finger = Recorded::<CAPTURE_BYTES>::begun(task);
        finger.frames(random.u32(0..30_000));
        let odd = random.u32(2..200);
        for _ in 0..3_000 {
            finger.frame_with(|record| {
                if random.u32(0..odd) == 0 {
                    let code = random.u16(..);
                    record.frame.set_code(random.usize(0..=ROWS), random.usize(0..COLUMNS), code);
                    record.sense.encoder = record.sense.encoder.wrapping_add(random.i32(-60..60));
                    record.sense.chip = Some(Celsius::from_bits(random.i32(..)));
                }
                if random.u32(0..20 * odd) == 0 {
                    record.sense.encoder = random.i32(..);
                    record.sense.supply_mv = random.u16(..);
                }
            });
        }
        finger.bench.request(Task::Stop);
        finger.frame();
        if finger.ends().measure.state != MeasureState::None && task != Task::Jog {
            match task {
                Task::Press => assert!(finger.recorded_press().steps.len() <= ROWS_MAX),
                // Whose counts may be beyond those of a sample.
                _ => assert!(matches!(
                    strokes(finger.closed(), &images::CONFIRMED),
                    Ok(_) | Err(NoRecord::Clipped(..) | NoRecord::Stroke(_))
                )),
            }
        }
        assert_ne!(finger.capture.standing().state, CaptureState::Recording);
    }
}

type Made = Recorded;
type Act = fn(&mut Made);

const ENDS: [(&str, Act); 6] = [
    ("stop", |finger| finger.bench.request(Task::Stop)),
    // Off in a press, on in strokes.
    ("torque", |finger| finger.bench.command().torque ^= true),
    ("tare", |finger| {
        finger.bench.command().tare_request += 1;
        finger.bench.command().tare_forced = true;
    }),
    ("fault", |finger| _ = finger.frame_with(|record| record.sense.bridge_fault = true)),
    ("stopped", |finger| finger.bench.pipeline().stop(Fault::LostFrames)),
    ("parameters", |finger| finger.bench.pipeline().configure(&config())),
];

/// Frames of a whole motion.
fn frames(task: Task) -> u32 {
    let mut finger = Made::begun(task);
    let frames = (1..).find(|_| finger.frame().measure.state != MeasureState::Running).expect("an end");
    finger.assert_ended(task, Ended::Complete);
    frames
}

sim::sizes!(a_motion_ends_at_any_moment_and_the_next_one_works, end_and_go_on: &[1], &[0, 2, 3, 4, 5, 6]);

fn end_and_go_on(parts: &[u32]) {
    for task in [Task::Jog, Task::Strokes, Task::Press] {
        let frames = frames(task);
        for (number, (name, act)) in ENDS.into_iter().enumerate() {
            for part in parts {
                let at = 1 + (frames - 40) * part / 6 + number as u32;
                let mut finger = Made::begun(task);
                finger.frames(at);
                assert_eq!(finger.bench.status().measure.state, MeasureState::Running, "{name} at {at}");
                act(&mut finger);
                let mut waited = 0;
                while finger.bench.status().measure.state == MeasureState::Running {
                    finger.frame();
                    waited += 1;
                    assert!(waited < 5_000, "{name} at {at}: {:?}", finger.bench.status());
                }
                finger.frame();
                finger.assert_ended(task, Ended::Interrupted);
                // Goal 0: a press that was stopped releases.
                finger.frames(7_000);
                let status = *finger.bench.status();
                assert!(!matches!(status.mode, Mode::Press | Mode::Strokes), "{name} at {at}: {status:?}");
                let speed = finger.bench.truth().speed_mm_per_s;
                assert!(speed.abs() < 0.05, "{task:?}, {name} at {at}: {speed} mm/s");

                let command = finger.bench.command();
                command.torque = false;
                command.clear_request += 1;
                finger.frame();
                finger.bench.place(0.0);
                finger.bench.command().tare_request += 1;
                finger.frames(2_000);
                finger.begin(Task::Strokes);
                finger.frames(2_000);
                assert_eq!(finger.bench.status().measure.state, MeasureState::Running, "{name} at {at}");
            }
        }
    }
}

/// Torque off and strokes in one write during a press: the press ends with its own record, without rows of the strokes.
#[test]
fn a_motion_that_replaces_another_is_one_of_its_own() {
    let mut finger = Made::begun(Task::Press);
    while finger.capture.standing().frames < 3 {
        finger.frame();
    }
    finger.bench.command().torque = false;
    finger.bench.request(Task::Strokes);
    finger.frame();
    finger.assert_ended(Task::Press, Ended::Interrupted);
    finger.frames(20_000);
    let measure = finger.bench.status().measure;
    assert_eq!(measure.task, Task::Strokes, "{measure:?}");
    // And a tare with a jog.
    let mut finger = Made::begun(Task::Strokes);
    finger.frames(3_000);
    finger.bench.command().tare_request += 1;
    finger.bench.request(Task::Jog);
    finger.frame();
    finger.assert_ended(Task::Strokes, Ended::Interrupted);
    finger.frame();
    let measure = finger.bench.status().measure;
    assert_eq!((measure.task, measure.ended), (Task::Jog, Ended::NotReady));
}

/// The stop of a jog that still waits reports `Interrupted`; a stop with no motion keeps the last outcome.
#[test]
fn a_stop_of_a_motion_that_waits_has_an_outcome_of_its_own() {
    let mut finger = Made::begun(Task::Jog);
    finger.ends();
    finger.bench.request(Task::Stop);
    finger.frame();
    assert_eq!(finger.bench.status().measure, MeasureStatus::over(Task::Jog, Ended::Complete, 0));
    finger.bench.request(Task::Jog);
    finger.bench.request(Task::Stop);
    assert_eq!(finger.frame().measure, MeasureStatus::over(Task::Stop, Ended::Interrupted, 0));
}

/// A jog runs before the direction is confirmed, so no part of it, the way back included, has more than 8 % of the supply.
#[test]
fn a_jog_keeps_to_its_share_of_the_supply() {
    let mut completed = 0;
    // Up to a friction from which the tip does not move.
    for percent_of_friction in (100..=600).step_by(100) {
        let mut setup = Setup::default();
        setup.motor.friction_nm *= f64::from(percent_of_friction) / 100.0;
        let mut finger = Made::of(&setup, &config());
        finger.bench.command().tare_request += 1;
        finger.frames(TARE_FRAMES + 2);
        finger.begin(Task::Jog);
        let mut most = 0;
        while finger.frame().measure.state == MeasureState::Running {
            assert_ne!(finger.bench.status().bridge(), Bridge::Open, "a moving tip is driven or braked");
            most = finger.bench.status().duty.0.unsigned_abs().max(most);
        }
        assert_eq!(finger.bench.status().bridge(), Bridge::Brakes);
        completed += u32::from(finger.bench.status().measure.ended == Ended::Complete);
        let percent = 100.0 * f64::from(most) / f64::from(Duty::FULL);
        assert!((2.0..=8.0).contains(&percent), "friction of {percent_of_friction} %: {percent} % of the supply");
    }
    assert!((4..6).contains(&completed), "{completed} jogs");
}

/// Fast, and as slowly as torque could be enabled.
#[test]
fn a_jog_waits_while_a_hand_moves_the_tip() {
    for counts in [4, 1] {
        let mut finger = Made::tared();
        let mut moved = 0;
        let mut modes = |frames: usize, counts: i32| -> Vec<Mode> {
            let mode = |_| {
                moved += counts;
                finger.bench.step_with(|record| record.sense.encoder += moved).mode
            };
            let modes = (0..frames).map(mode).collect();
            if finger.bench.command().measure_request == 0 {
                finger.bench.request(Task::Jog);
            }
            modes
        };
        modes(100, counts);
        assert!(modes(300, counts).iter().all(|mode| *mode == Mode::Off));
        assert_eq!(modes(1_000, 0).last(), Some(&Mode::Strokes));
    }
}

/// The host ends the record in the middle: the motion continues without a record, the next motion has one again.
#[test]
fn a_record_ended_by_the_host_is_whole() {
    let mut finger = Made::begun(Task::Press);
    while finger.capture.standing().frames < 3 {
        finger.frame();
    }
    finger.capture.end(CaptureEnded::Asked);
    let bytes = finger.capture.data().to_vec();
    let (_, ended, rows, _) = head(&bytes);
    assert_eq!((ended, rows), (Ended::Interrupted as u8, 3));
    assert_eq!(finger.recorded_press().steps.len(), 3);
    assert_eq!(finger.ends().measure.state, MeasureState::Done);
    assert!(finger.capture.data() == bytes && finger.capture.standing().count == 1, "it changes no more");
    finger.bench.place(0.0);
    finger.begin(Task::Strokes);
    assert_eq!(finger.capture.standing().state, CaptureState::Recording);
    assert!(finger.capture.data().is_empty(), "nothing can be read of a record that is not closed");
    finger.ends();
    finger.assert_ended(Task::Strokes, Ended::Complete);
    assert_eq!(finger.capture.standing().count, 2);
}
