//! Each promise of the envelope on a constructed finger: just kept and just broken.

use crate::observe;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::state::Fault;
use fingertip::units::Duty;
use sim::metrics::Meter;
use sim::population::load;
use sim::watch::Truth;
use std::collections::BTreeSet;
use std::ops::Range;

/// Travel at the touch, mm, and indentation per force.
const TOUCH_MM: f64 = 5.0;
const MM_PER_N: f64 = 0.5;
/// Times, s, and goals, N: three forces, a release, and a second touch and release.
const SCRIPT: [(f64, f64); 6] = [(0.0, 1.0), (0.9, 4.0), (1.5, 2.0), (2.1, 0.0), (3.1, 1.0), (3.8, 0.0)];

/// State of the world at a time.
#[derive(Clone, Copy, Debug, Default)]
struct Made {
    time_s: f64,
    /// Time since the goal changed, s, and number of steps since the start.
    since_s: f64,
    steps: usize,
    goal_n: f64,
    force_n: f64,
    travel_mm: f64,
    speed_mm_per_s: f64,
    duty: f64,
    fault: Option<Fault>,
    torque_off: bool,
    friction_n: f64,
    object_mm: f64,
    disturbed: bool,
}

/// Returns the promises that a perfect finger breaks after a change of its states.
fn broken(change: impl Fn(&mut Made)) -> BTreeSet<String> {
    let bounds = load("handled").unwrap().finger(1, 0).unwrap().scene.bounds;
    let mut meter = Meter::default();
    for steps in 0..=44_000 {
        let time_s = f64::from(steps) * 1e-4;
        let (at_s, goal_n) = SCRIPT.into_iter().rfind(|(at_s, _)| *at_s <= time_s).unwrap();
        let touches = time_s > 0.2 && goal_n > 0.0;
        let mut made = Made { time_s, since_s: time_s - at_s, steps: steps as usize, goal_n, ..Made::default() };
        made.force_n = if touches { goal_n } else { 0.0 };
        made.travel_mm = if touches { TOUCH_MM + MM_PER_N * goal_n } else { TOUCH_MM - 1.0 };
        change(&mut made);
        let truth = Truth {
            force_n: made.force_n,
            indentation_mm: MM_PER_N * made.force_n.min(made.goal_n),
            travel_mm: made.travel_mm,
            speed_mm_per_s: made.speed_mm_per_s,
            friction_n: made.friction_n,
            object_mm: [made.object_mm, 0.0],
            disturbed: made.disturbed,
            ..Truth::default()
        };
        let command = Command { goal: newtons((goal_n * 1e3) as i32), torque: !made.torque_off, ..Command::default() };
        let duty = Duty((made.duty * f64::from(Duty::FULL)).round() as _);
        let status = Status { duty, fault: made.fault, ..Status::default() };
        observe(&mut meter, 0, time_s, &command, &status, &truth);
    }
    let verdicts = meter.verdicts(&meter.measured(), &bounds).into_iter();
    verdicts.filter(|verdict| !verdict.held).map(|verdict| verdict.bound.metric).collect()
}

/// A finger that keeps all promises by a little, and one that breaks these by a little.
#[track_caller]
fn two_sided(change: impl Fn(&mut Made, f64), kept: f64, broke: f64, promises: &[&str]) {
    assert_eq!(broken(|made| change(made, kept)), BTreeSet::new(), "at {kept}");
    let expected: BTreeSet<String> = promises.iter().map(|name| (*name).into()).collect();
    assert_eq!(broken(|made| change(made, broke)), expected, "at {broke}");
}

/// Up and down, step by step.
fn sign(made: &Made) -> f64 {
    if made.steps.is_multiple_of(2) { 1.0 } else { -1.0 }
}

#[test]
fn over_force() {
    let at = |goal_n: f64, since_s: Range<f64>| {
        move |made: &mut Made, force_n: f64| {
            if made.goal_n == goal_n && since_s.contains(&made.since_s) {
                made.force_n = force_n;
            }
        }
    };
    two_sided(at(4.0, 0.0..0.00005), 1.3 * 4.0 + 0.149, 1.3 * 4.0 + 0.151, &["over_force_mn"]);
    // At the least goal, and with none.
    two_sided(at(1.0, 0.45..0.4501), 1.449, 1.451, &["over_force_mn"]);
    two_sided(at(0.0, 0.45..0.4501), 0.149, 0.151, &["over_force_mn"]);
    // A goal that is taken back counts for 200 ms.
    two_sided(|made, late_s| at(2.0, 0.0..late_s)(made, 4.0), 0.199, 0.202, &["over_force_mn"]);
}

#[test]
fn running_away() {
    let clearance_mm = f64::from(Params::DEFAULT.clearance_um) * 1e-3;
    // The finger first touches where it presses with 1 N.
    let rear_mm = TOUCH_MM + MM_PER_N - MM_PER_N * 4.0 - clearance_mm;
    let back = |made: &mut Made, behind_mm: f64| {
        if made.time_s > 2.1 && made.goal_n == 0.0 {
            made.travel_mm = rear_mm - behind_mm;
        }
    };
    two_sided(back, 0.999, 1.001, &["runaway_mm"]);
    for (limit_mm, way) in [(-clearance_mm, -1.0), (f64::from(Params::DEFAULT.travel_max_um) * 1e-3, 1.0)] {
        let before = |made: &mut Made, beyond_mm: f64| {
            if made.time_s < 0.1 {
                made.travel_mm = limit_mm + way * beyond_mm;
            }
        };
        two_sided(before, 0.999, 1.001, &["runaway_mm"]);
    }
}

#[test]
fn fast_in_the_air() {
    let approach_mm_per_s = f64::from(Params::DEFAULT.approach_um_per_s) * 1e-3;
    for way in [1.0, -1.0] {
        let flies = |made: &mut Made, share: f64| {
            if made.goal_n == 0.0 && (0.03..0.031).contains(&made.since_s) {
                made.speed_mm_per_s = way * share * approach_mm_per_s;
            }
        };
        two_sided(flies, 1.499, 1.501, &["air_speed_percent"]);
    }
    // What a contact throws back has 20 ms.
    let thrown = |made: &mut Made, until_s: f64| {
        if made.goal_n == 0.0 && made.since_s < until_s {
            made.speed_mm_per_s = -200.0;
        }
    };
    two_sided(thrown, 0.0195, 0.0205, &["air_speed_percent"]);
}

#[test]
fn no_rest_after_letting_go() {
    let wanders = |made: &mut Made, width_mm: f64| {
        if made.goal_n == 0.0 && made.since_s < 0.9 {
            made.travel_mm -= 0.5 * width_mm * sign(made);
        } else if made.goal_n == 0.0 {
            made.travel_mm += 0.5 * width_mm * sign(made);
        }
    };
    two_sided(wanders, 0.0499, 0.0501, &["rest_travel_um"]);
}

#[test]
fn a_stop_that_leaves_a_force() {
    let stays = |made: &mut Made, until_s: f64| {
        if made.goal_n == 0.0 && made.since_s < until_s {
            made.force_n = 0.041;
        }
    };
    two_sided(stays, 0.499, 0.501, &["stop_force_mn"]);
    let remains = |made: &mut Made, force_n: f64| {
        if made.goal_n == 0.0 {
            made.force_n = force_n;
        }
    };
    two_sided(remains, 0.0399, 0.0401, &["stop_force_mn"]);
    // A force that friction holds while torque is off does not count against the controller.
    let held = |made: &mut Made, friction_n: f64| {
        made.torque_off = made.time_s > 0.3;
        (made.disturbed, made.friction_n, made.force_n) = (true, friction_n, made.force_n.min(1.0));
    };
    two_sided(held, 0.961, 0.959, &["stop_force_mn"]);
    // An object that moves nearer ends the stop; a fault is a reason.
    let pushed = |made: &mut Made, by_mm: f64| {
        (made.disturbed, made.object_mm) = (made.time_s > 2.2, if made.time_s > 2.4 { by_mm } else { 0.0 });
        remains(made, if (2.5..3.0).contains(&made.time_s) { 0.1 } else { 0.0 });
    };
    two_sided(pushed, -0.1, 0.1, &["stop_force_mn"]);
    assert!(!broken(|made| (made.fault, made.force_n) = (Some(Fault::RowStuck), 1.0)).contains("stop_force_mn"));
}

#[test]
fn swinging() {
    let swings = |made: &mut Made, width_n: f64| {
        if made.goal_n == 2.0 && made.since_s > 0.45 {
            made.force_n += 0.5 * width_n * sign(made);
        }
    };
    two_sided(swings, 0.249, 0.251, &["hold_swing_mn"]);
}

#[test]
fn hunting() {
    for holds in [true, false] {
        let hunts = |made: &mut Made, deviation: f64| {
            made.duty = 0.2;
            if (made.goal_n > 0.0) == holds {
                made.duty += deviation * sign(made);
            }
        };
        two_sided(hunts, 0.0499, 0.0501, &["rest_duty_percent"]);
    }
}

#[test]
fn any_fault() {
    let faults = |made: &mut Made, at_s: f64| {
        made.fault = (made.time_s >= at_s).then_some(Fault::SupplyLow);
    };
    two_sided(faults, 5.0, 4.3, &["faults_count"]);
    // What a fault ended is not judged as a force that was not held.
    let lets_go = |made: &mut Made, at_s: f64| {
        faults(made, at_s);
        if made.fault.is_some() {
            made.force_n = 0.0;
        }
    };
    two_sided(lets_go, 5.0, 1.0, &["faults_count"]);
}

#[test]
fn force_not_held() {
    for way in [1.0, -1.0] {
        let off = |made: &mut Made, off_n: f64| {
            if made.goal_n == 2.0 && made.since_s > 0.3 {
                made.force_n += way * off_n;
            }
        };
        two_sided(off, 0.399, 0.401, &["hold_error_mn"]);
    }
}

#[test]
fn a_touch_that_is_missed() {
    let misses = |made: &mut Made, until_s: f64| {
        if made.time_s > 3.0 && made.time_s < until_s && made.goal_n > 0.0 {
            made.force_n = 0.0;
            made.travel_mm = TOUCH_MM;
        }
    };
    two_sided(misses, 3.5, 3.9, &["hold_error_mn", "touches_missed_count"]);
}
