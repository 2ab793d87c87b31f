//! Early ends of a motion: the motor rests, the motion and its record say so, and the next one works.

use crate::common::*;
use fingertip::capture::Ended as CaptureEnded;

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

#[test]
fn a_motion_ends_at_any_moment_and_the_next_one_works() {
    end_and_go_on(&[0, 4]);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_a_motion_ends_at_any_moment_and_the_next_one_works() {
    end_and_go_on(&[1, 2, 3, 5, 6]);
}

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
                finger.frames(15_000);
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

/// The host ends the record in the middle: the motion continues without a record, the next motion has one again.
#[test]
fn a_record_ended_by_the_host_is_whole() {
    let mut finger = Made::begun(Task::Press);
    while finger.capture.standing().frames < 3 {
        finger.frame();
    }
    finger.capture.end(CaptureEnded::Asked);
    let bytes = finger.capture.data().to_vec();
    let record = finger.record();
    assert_eq!((record.ended, record.rows), (Ended::Interrupted as u8, 3));
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

// A request that cannot be served has its reason at once.

/// The array with the object pressed in.
fn pressed(mut finger: Made) -> Made {
    finger.bench.place_object(-0.8);
    finger.frames(20);
    finger
}

fn with_torque(mut finger: Made) -> Made {
    finger.bench.command().torque = true;
    finger.frame();
    finger
}

/// During a tare, or after it.
fn taring(mut finger: Made, frames: u32) -> Made {
    finger.bench.command().tare_request += 1;
    finger.frames(frames);
    finger
}

/// A state, how it is made, and how a jog, strokes and a press end in it.
type Case = (&'static str, fn() -> Made, [Option<Ended>; 3]);

/// States of a finger, with the refusals of a jog, of strokes and of a press in each; `None` if the motion begins.
#[test]
fn every_state_has_its_answer() {
    const NO: Option<Ended> = Some(Ended::NotReady);
    let states: [Case; 10] = [
        ("not tared", Made::untared, [NO; 3]),
        ("not tared, torque on", || with_torque(Made::untared()), [NO; 3]),
        ("tared", Made::tared, [None, None, NO]),
        (
            "unconfirmed",
            || {
                let mut finger = Made::of(&Setup::default(), &allowed(Params::DEFAULT));
                finger.bench.tare();
                finger.bench.command().torque = false;
                finger
            },
            [None, Some(Ended::Unconfirmed), NO],
        ),
        ("torque on", || with_torque(Made::tared()), [NO, NO, None]),
        ("taring", || taring(Made::tared(), 1), [NO; 3]),
        ("touching", || pressed(Made::tared()), [NO; 3]),
        ("tared while touching", || taring(pressed(Made::untared()), 700), [NO; 3]),
        (
            "gains changed",
            || {
                let mut finger = Made::tared();
                finger.bench.pipeline().calibrate(&Calibration::NONE);
                finger
            },
            [NO; 3],
        ),
        (
            "fault",
            || {
                let mut finger = with_torque(Made::tared());
                finger.frame_with(|record| record.sense.bridge_fault = true);
                finger.bench.command().torque = false;
                finger.frame();
                assert_eq!(finger.bench.status().mode, Mode::Fault);
                finger
            },
            [NO; 3],
        ),
    ];
    for (name, made, answers) in states {
        for (task, answer) in [Task::Jog, Task::Strokes, Task::Press].into_iter().zip(answers) {
            let mut finger = made();
            finger.bench.request(task);
            let status = finger.frame();
            let (measure, taken) = (status.measure, status.taken.measure);
            assert_eq!((measure.task, taken), (task, finger.bench.command().measure_request), "{name}");
            let began = (MeasureState::Running, Ended::Complete);
            let expected = answer.map_or(began, |ended| (MeasureState::Ended, ended));
            assert_eq!((measure.state, measure.ended), expected, "{name}: {task:?}");
            assert_eq!(matches!(status.mode, Mode::Press | Mode::Strokes), answer.is_none(), "{name}: {task:?}");
        }
    }
}

#[test]
fn a_request_during_a_motion_is_answered_by_its_end() {
    for task in [Task::Jog, Task::Press] {
        let end = |others: &[Task]| {
            let mut finger = Made::begun(task);
            for other in others {
                finger.bench.request(*other);
                let status = finger.frame();
                assert_eq!((status.measure.task, status.measure.state), (task, MeasureState::Running));
                assert_eq!(status.taken.measure, finger.bench.command().measure_request);
            }
            finger.ends().measure
        };
        assert_eq!(end(&[]), end(&[Task::Jog, Task::Strokes, Task::Press]));
        assert_eq!(end(&[]).state, MeasureState::Done);
    }
}
