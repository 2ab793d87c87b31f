//! One event at each of many instants of a press: torque off, goal 0, a fault of the bridge, a lost signal, a silent bus.
//! Every 100th of the 500 instants of each press is tried, every 20th by `cargo xtask test --long`, and all by
//! `INSTANTS_STEP=1 cargo test -p sim --profile host --test fingers instants -- --ignored --nocapture`

use crate::{
    CONTACT_ON_N, Case, Finger, LOSSES, begun, judge, most_n, number, object, run_with, scene, set_goal, show, touch_s,
};
use fingertip::shipped::Frame;
use sim::cores;
use sim::scene::Scene;

/// Instants of the press for each goal.
const INSTANTS: u64 = 500;

/// From the touch to the last instant, s.
const AFTER_TOUCH_S: f64 = 0.3;

/// Time watched after the event, s.
const WATCHED_S: f64 = 0.5;

const GOALS_N: [f64; 4] = [0.5, 1.0, 3.0, 7.0];

/// Compliance of the objects, mm/N: a wall and a soft one.
const OBJECTS_MM_PER_N: [f64; 2] = [0.0, 1.0];

/// Largest force that a release may leave, N. A touch that reads just below `contact_on_mn` is not released.
const LEFT_N: f64 = CONTACT_ON_N + 0.005;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    TorqueOff,
    GoalZero,
    BridgeFault,
    LostSignal,
    SilentBus,
}

impl Event {
    const ALL: [Self; 5] = [Self::TorqueOff, Self::GoalZero, Self::BridgeFault, Self::LostSignal, Self::SilentBus];

    /// Returns true if the motor moves the tip off the object, so that friction holds no force.
    fn releases(self) -> bool {
        matches!(self, Self::GoalZero | Self::SilentBus)
    }

    /// Lets it happen to a copy of the finger; returns the largest true force until the end, and the last one, N.
    fn happens(self, finger: &Finger, scene: &Scene, blank: &Frame) -> (f64, f64) {
        let mut finger = finger.fork(scene).unwrap_or_else(|error| panic!("{error}"));
        match self {
            Self::TorqueOff => finger.command().torque = false,
            Self::GoalZero => set_goal(&mut finger, 0.0),
            Self::SilentBus => finger.command().bus_watchdog_ms = 100,
            Self::BridgeFault | Self::LostSignal => {}
        }
        let peak_n = run_with(&mut finger, WATCHED_S, |record| match self {
            Self::BridgeFault => record.sense.bridge_fault = true,
            Self::LostSignal => show(record, blank),
            Self::SilentBus => record.sense.bus_silent_ms = 200,
            Self::TorqueOff | Self::GoalZero => {}
        });
        if self == Self::SilentBus {
            assert_eq!(finger.status().fault, Some(fingertip::state::Fault::BusSilent));
        }
        (peak_n, finger.truth().force_n)
    }
}

/// The largest force after each event in one press, with the time after the touch, and the largest that is left 0.5 s
/// later. `first` and `every` choose the instants.
fn press(goal_n: f64, yield_mm_per_n: f64, first: u64, every: u64) -> [(f64, f64, f64); Event::ALL.len()] {
    let tables = object(2.0, yield_mm_per_n) + LOSSES;
    let (scene, approach_s) = (scene(&tables), touch_s(&tables, goal_n));
    let mut finger = begun(&scene);
    let (blank, begun_s) = (*finger.frame(), finger.time_s());
    set_goal(&mut finger, goal_n);
    let mut worst = [(0.0, 0.0, 0.0_f64); Event::ALL.len()];
    for instant in (first..INSTANTS).step_by(every as usize) {
        let at_s = (approach_s + AFTER_TOUCH_S) * instant as f64 / INSTANTS as f64;
        while finger.time_s() < begun_s + at_s {
            finger.step();
        }
        for (event, worst) in Event::ALL.into_iter().zip(&mut worst) {
            let (peak_n, left_n) = event.happens(&finger, &scene, &blank);
            let peak_n = peak_n.max(finger.truth().force_n);
            worst.2 = worst.2.max(left_n);
            if peak_n > worst.0 {
                (worst.0, worst.1) = (peak_n, at_s - approach_s);
            }
        }
    }
    worst
}

#[test]
fn an_event_at_any_instant_of_a_press_does_not_let_the_force_rise() {
    keep_the_force(100);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_an_event_at_any_instant_of_a_press_does_not_let_the_force_rise() {
    keep_the_force(number("INSTANTS_STEP", 20).clamp(1, INSTANTS));
}

fn keep_the_force(every: u64) {
    let presses: Vec<_> =
        GOALS_N.into_iter().flat_map(|goal_n| OBJECTS_MM_PER_N.map(|object| (goal_n, object))).collect();
    // Each press tries other instants, so that few of them cover the time more densely.
    let worst = cores::map(presses.iter().enumerate(), |(number, (goal_n, object))| {
        press(*goal_n, *object, every * number as u64 / presses.len() as u64, every)
    });
    let (mut cases, mut released) = (Vec::new(), Vec::new());
    for (index, event) in Event::ALL.into_iter().enumerate() {
        for ((goal_n, object), worst) in presses.iter().zip(&worst) {
            let (peak_n, at_s, left_n) = worst[index];
            let what = format!("{event:?} {at_s:+.4} s from the touch, goal {goal_n} N, {object} mm/N");
            if event.releases() {
                released.push(Case::new(what.clone(), left_n, LEFT_N));
            }
            // The bridge is open after its fault: the motor coasts, and nothing can stop it.
            let most_n = if event == Event::BridgeFault { f64::INFINITY } else { most_n(*goal_n) };
            cases.push(Case::new(what, peak_n, most_n));
        }
    }
    judge("events at many instants", "N", &cases);
    judge("what is left 0.5 s after a release", "N", &released);
}

/// The copies above are exact.
#[test]
fn a_copy_of_a_finger_goes_on_to_the_bit() {
    let scene = scene(&(object(2.0, 1.0) + LOSSES));
    let mut finger = begun(&scene);
    crate::press(&mut finger, 3.0, 0.09);
    let mut copy = finger.fork(&scene).unwrap();
    for frame in 0..3_000 {
        assert_eq!(finger.step(), copy.step(), "frame {frame}");
        assert!(finger.record() == copy.record() && finger.truth() == copy.truth(), "frame {frame}");
    }
    assert!(finger.truth().force_n > 2.5);
}
