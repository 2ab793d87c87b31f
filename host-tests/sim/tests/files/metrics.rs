//! Metrics on constructed fingers: each promise of the envelope just kept and just broken, and step responses whose
//! figures are known.

use crate::*;
use fingertip::units::Duty;
use sim::metrics::Measured;
use sim::population::load;
use std::ops::RangeBounds;

/// Travel at the touch, mm, and indentation per force.
const TOUCH_MM: f64 = 5.0;
const MM_PER_N: f64 = 0.5;
/// Times, s, and goals, N: three forces, a release, and a second touch and release.
const SCRIPT: [(f64, f64); 6] = [(0.0, 1.0), (0.9, 4.0), (1.5, 2.0), (2.1, 0.0), (3.1, 1.0), (3.8, 0.0)];

/// State of the world and of the finger at a time.
#[derive(Default)]
struct Made {
    time_s: f64,
    /// Time since the goal changed, s, and number of steps since the start.
    since_s: f64,
    steps: usize,
    goal_n: f64,
    duty: f64,
    truth: Truth,
    command: Command,
    fault: Option<Fault>,
}

/// Returns the promises that a perfect finger breaks after a change of its states.
fn broken(change: impl Fn(&mut Made)) -> BTreeSet<String> {
    let bounds = load("handled").unwrap().finger(1, 0).unwrap().scene.bounds;
    let mut meter = Meter::default();
    for steps in 0..=44_000 {
        let time_s = f64::from(steps) * 1e-4;
        let (at_s, goal_n) = SCRIPT.into_iter().rfind(|(at_s, _)| *at_s <= time_s).unwrap();
        let touches = time_s > 0.2 && goal_n > 0.0;
        let command = Command { goal: newtons((goal_n * 1e3) as i32), torque: true, ..Command::default() };
        let truth = Truth {
            force_n: if touches { goal_n } else { 0.0 },
            travel_mm: if touches { TOUCH_MM + MM_PER_N * goal_n } else { TOUCH_MM - 1.0 },
            ..Truth::default()
        };
        let (since_s, steps) = (time_s - at_s, steps as usize);
        let mut made = Made { time_s, since_s, steps, goal_n, truth, command, ..Made::default() };
        change(&mut made);
        made.truth.indentation_mm = MM_PER_N * made.truth.force_n.min(goal_n);
        let duty = Duty((made.duty * f64::from(Duty::FULL)).round() as _);
        let status = Status { duty, fault: made.fault, ..Status::default() };
        observe(&mut meter, 0, time_s, &made.command, &status, &made.truth);
    }
    let verdicts = meter.verdicts(&meter.measured(), &bounds).into_iter();
    verdicts.filter(|verdict| !verdict.held).map(|verdict| verdict.metric).collect()
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

/// Changes the states with this goal at these times since the goal, s.
fn while_held(goal_n: f64, since_s: impl RangeBounds<f64>, change: impl Fn(&mut Made, f64)) -> impl Fn(&mut Made, f64) {
    move |made, value| {
        if made.goal_n == goal_n && since_s.contains(&made.since_s) {
            change(made, value);
        }
    }
}

#[test]
fn over_force() {
    let at = |goal_n, since_s: Range<f64>| while_held(goal_n, since_s, |made, force_n| made.truth.force_n = force_n);
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
            made.truth.travel_mm = rear_mm - behind_mm;
        }
    };
    two_sided(back, 0.999, 1.001, &["runaway_mm"]);
    for (limit_mm, way) in [(-clearance_mm, -1.0), (f64::from(Params::DEFAULT.travel_max_um) * 1e-3, 1.0)] {
        let before = |made: &mut Made, beyond_mm: f64| {
            if made.time_s < 0.1 {
                made.truth.travel_mm = limit_mm + way * beyond_mm;
            }
        };
        two_sided(before, 0.999, 1.001, &["runaway_mm"]);
    }
}

#[test]
fn fast_in_the_air() {
    let approach_mm_per_s = f64::from(Params::DEFAULT.approach_um_per_s) * 1e-3;
    for way in [approach_mm_per_s, -approach_mm_per_s] {
        let flies = while_held(0.0, 0.03..0.031, |made, share| made.truth.speed_mm_per_s = way * share);
        two_sided(flies, 1.499, 1.501, &["air_speed_percent"]);
    }
    // What a contact throws back has 20 ms.
    let thrown = |made: &mut Made, until_s: f64| {
        while_held(0.0, ..until_s, |made, mm_per_s| made.truth.speed_mm_per_s = mm_per_s)(made, -200.0);
    };
    two_sided(thrown, 0.0195, 0.0205, &["air_speed_percent"]);
}

#[test]
fn no_rest_after_letting_go() {
    let wanders = while_held(0.0, .., |made, width_mm| {
        made.truth.travel_mm += 0.5 * width_mm * sign(made) * if made.since_s < 0.9 { -1.0 } else { 1.0 };
    });
    two_sided(wanders, 0.0499, 0.0501, &["rest_travel_um"]);
}

#[test]
fn a_stop_that_leaves_a_force() {
    let remains = while_held(0.0, .., |made, force_n| made.truth.force_n = force_n);
    let stays = |made: &mut Made, until_s: f64| while_held(0.0, ..until_s, &remains)(made, 0.041);
    two_sided(stays, 0.499, 0.501, &["stop_force_mn"]);
    two_sided(&remains, 0.0399, 0.0401, &["stop_force_mn"]);
    // A force that friction holds while torque is off does not count against the controller.
    let held = |made: &mut Made, friction_n: f64| {
        made.command.torque = made.time_s <= 0.3;
        let truth = &mut made.truth;
        (truth.disturbed, truth.friction_n, truth.force_n) = (true, friction_n, truth.force_n.min(1.0));
    };
    two_sided(held, 0.961, 0.959, &["stop_force_mn"]);
    // An object that moves nearer ends the stop; a fault is a reason.
    let pushed = |made: &mut Made, by_mm: f64| {
        made.truth.disturbed = made.time_s > 2.2;
        made.truth.object_mm[0] = if made.time_s > 2.4 { by_mm } else { 0.0 };
        remains(made, if (2.5..3.0).contains(&made.time_s) { 0.1 } else { 0.0 });
    };
    two_sided(pushed, -0.1, 0.1, &["stop_force_mn"]);
    assert!(!broken(|made| (made.fault, made.truth.force_n) = (Some(Fault::RowStuck), 1.0)).contains("stop_force_mn"));
}

#[test]
fn a_force_that_swings_or_is_not_held() {
    let swings = while_held(2.0, 0.45.., |made, width_n| made.truth.force_n += 0.5 * width_n * sign(made));
    two_sided(swings, 0.249, 0.251, &["hold_swing_mn"]);
    for way in [1.0, -1.0] {
        let off = while_held(2.0, 0.3.., |made, off_n| made.truth.force_n += way * off_n);
        two_sided(off, 0.399, 0.401, &["hold_error_mn"]);
    }
}

#[test]
fn hunting() {
    for holds in [true, false] {
        let hunts = |made: &mut Made, deviation: f64| {
            made.duty = 0.2 + if (made.goal_n > 0.0) == holds { deviation * sign(made) } else { 0.0 };
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
            made.truth.force_n = 0.0;
        }
    };
    two_sided(lets_go, 5.0, 1.0, &["faults_count"]);
}

#[test]
fn a_touch_that_is_missed() {
    let misses = |made: &mut Made, until_s: f64| {
        if made.time_s > 3.0 && made.time_s < until_s && made.goal_n > 0.0 {
            (made.truth.force_n, made.truth.travel_mm) = (0.0, TOUCH_MM);
        }
    };
    two_sided(misses, 3.5, 3.9, &["hold_error_mn", "touches_missed_count"]);
}

/// A step a ms, force and travel a function of the time in ms.
fn measured(goal_mn: i32, steps: usize, force_n: impl Fn(f64) -> f64, travel_mm: impl Fn(f64) -> f64) -> Measured {
    let mut meter = Meter::default();
    let command = Command { goal: newtons(goal_mn), ..Command::default() };
    for ms in (0..steps).map(|ms| ms as f64) {
        let truth = Truth { force_n: force_n(ms), travel_mm: travel_mm(ms), ..Truth::default() };
        observe(&mut meter, 0, ms * 1e-3, &command, &Status::default(), &truth);
    }
    meter.measured()
}

fn pressed(goal_mn: i32, steps: usize, force_n: impl Fn(f64) -> f64) -> Measured {
    measured(goal_mn, steps, force_n, |_| 0.0)
}

#[track_caller]
fn close(measured: &Measured, name: &str, expected: f64) {
    let value = measured.get(name).unwrap_or_else(|| panic!("no {name}"));
    assert!((value - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{name}: {value} instead of {expected}");
}

#[test]
fn a_ramp_rises_in_eight_tenths_of_its_time() {
    let ramp = pressed(2_000, 300, |ms| 1.0 + (ms / 20.0).min(1.0));
    close(&ramp, "rise_ms", 16.0);
    close(&ramp, "overshoot_percent", 0.0);
    close(&ramp, "steady_error_max_mn", 0.0);
    // 98 % of the step would be 19.6 ms: the first sample inside is that of 20 ms.
    close(&ramp, "settling_ms", 20.0);
}

#[test]
fn overshoot_and_settling_take_the_smaller_of_goal_and_step() {
    let by = |goal_mn, from_n, beyond_n| {
        let goal_n = f64::from(goal_mn) * 1e-3;
        pressed(goal_mn, 300, move |ms| match ms {
            ..5.0 => from_n,
            ..50.0 => beyond_n,
            _ => goal_n,
        })
    };
    // Down from 5 N to 1 N, 30 mN beyond: 3 % of the goal, though only 0.75 % of the step.
    // Up from 4 N to 5 N, 30 mN beyond: 3 % of the step, though only 0.6 % of the goal.
    for measured in [by(1_000, 5.0, 0.97), by(5_000, 4.0, 5.03)] {
        close(&measured, "overshoot_percent", 3.0);
        close(&measured, "settling_ms", 50.0);
    }
}

#[test]
fn an_error_that_stays_is_a_steady_error() {
    close(&pressed(2_000, 300, |ms| if ms < 10.0 { 1.0 } else { 1.99 }), "steady_error_max_mn", 10.0);
    // One sample off before 100 ms does not count, one after does.
    let spike = |at_ms: f64| {
        pressed(2_000, 300, move |ms| match ms {
            _ if ms == at_ms => 2.05,
            ..10.0 => 1.0,
            _ => 2.0,
        })
    };
    close(&spike(99.0), "steady_error_max_mn", 0.0);
    close(&spike(101.0), "steady_error_max_mn", 50.0);
    close(&spike(101.0), "settling_ms", 102.0);
}

#[test]
fn a_touch_is_timed_from_the_start_and_what_follows_from_the_contact() {
    // 5 mm at 25 mm/s: touches after 200 ms, rises to 1.08 N within 10 ms, holds 1 N from 30 ms after the touch.
    let force_n = |ms: f64| match ms - 200.0 {
        ..=0.0 => 0.0,
        since @ ..10.0 => 0.1 * since,
        ..30.0 => 1.08,
        _ => 1.0,
    };
    let touching = measured(1_000, 500, force_n, |ms| 0.3 + (ms * 25e-3).min(5.5));
    close(&touching, "touch_ms", 201.0);
    close(&touching, "approach_mm_per_s", 25.0);
    close(&touching, "peak_force_n", 1.08);
    close(&touching, "settling_ms", 29.0);
    close(&touching, "steady_error_max_mn", 0.0);
}

#[test]
fn what_is_not_touched_or_does_not_rise_has_no_figures() {
    let names = ["touch_ms", "rise_ms", "settling_ms", "steady_error_max_mn"];
    assert_eq!(names.map(|name| pressed(1_000, 100, |_| 0.0).get(name)), [None; 4]);
    assert_eq!(pressed(2_000, 300, |_| 1.0).get("rise_ms"), None);
}
