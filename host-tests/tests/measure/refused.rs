//! A request that cannot be served has its reason at once.

use crate::finger::{Finger, params};
use fingertip::measure::{Ended, State, Task};
use fingertip::params::Params;
use fingertip::pressure::Calibration;
use fingertip::state::Mode;
use sim::native::bench::Bench;

type Made = Finger<{ 44 << 10 }>;

/// The array with the object pressed in.
fn pressed(finger: &mut Made) {
    finger.bench.place_object(-0.8);
    for _ in 0..20 {
        finger.frame();
    }
}

/// A state, how it is made, and how a jog, strokes and a press end in it.
type Case = (&'static str, fn() -> Made, [Option<Ended>; 3]);

/// Each state of a finger, and what becomes of a jog, of strokes and of a press in it; `None` begins.
#[test]
fn every_state_has_its_answer() {
    const NO: Option<Ended> = Some(Ended::NotReady);
    let states: [Case; 9] = [
        ("not tared", || Finger::with(&params()), [NO; 3]),
        ("tared", Finger::tared, [None, None, NO]),
        (
            "unconfirmed",
            || {
                let mut finger = Finger::with(&Params::DEFAULT);
                finger.bench.tare();
                finger.bench.command().torque = false;
                finger
            },
            [None, Some(Ended::Unconfirmed), NO],
        ),
        (
            "torque on",
            || {
                let mut finger = Made::tared();
                finger.bench.command().torque = true;
                finger.frame();
                finger
            },
            [NO, NO, None],
        ),
        (
            "taring",
            || {
                let mut finger = Made::tared();
                finger.bench.command().tare_request += 1;
                finger.frame();
                finger
            },
            [NO; 3],
        ),
        (
            "touching",
            || {
                let mut finger = Made::tared();
                pressed(&mut finger);
                finger
            },
            [NO; 3],
        ),
        (
            "tared while touching",
            || {
                let mut finger = Made::with(&params());
                pressed(&mut finger);
                finger.bench.command().tare_request += 1;
                (0..700).for_each(|_| _ = finger.frame());
                finger
            },
            [NO; 3],
        ),
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
                let mut finger = Made::tared();
                finger.bench.command().torque = true;
                finger.frame();
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
            let expected = answer.map_or((State::Running, Ended::Complete), |ended| (State::Ended, ended));
            assert_eq!((measure.state, measure.ended), expected, "{name}: {task:?}");
            assert_eq!(matches!(status.mode, Mode::Press | Mode::Strokes), answer.is_none(), "{name}: {task:?}");
        }
    }
}

/// The one under way answers for both, and is not disturbed.
#[test]
fn a_request_during_a_motion_is_answered_by_its_end() {
    for task in [Task::Jog, Task::Press] {
        let end = |others: &[Task]| {
            let mut finger = Made::begun(task);
            for other in others {
                finger.bench.request(*other);
                let status = finger.frame();
                assert_eq!((status.measure.task, status.measure.state), (task, State::Running));
                assert_eq!(status.taken.measure, finger.bench.command().measure_request);
            }
            let bench: &mut Bench = &mut finger.bench;
            bench.command();
            finger.ends().measure
        };
        assert_eq!(end(&[]), end(&[Task::Jog, Task::Strokes, Task::Press]));
        assert_eq!(end(&[]).state, State::Done);
    }
}
