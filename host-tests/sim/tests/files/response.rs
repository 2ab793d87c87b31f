//! Metrics of a step response, of synthetic forces whose figures are known.

use crate::observe;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::pipeline::Status;
use sim::metrics::{Measured, Meter};
use sim::watch::Truth;

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

/// Whatever the force does: after the settling time it is inside the band, and just before it was outside.
#[test]
fn settling_is_the_last_entry_into_the_band() {
    let mut rng = fastrand::Rng::with_seed(2003);
    let mut settled = 0;
    for length in 0..2_000 {
        let errors: Vec<f64> = (0..20 + length % 180).map(|_| 0.2 * rng.f64() - 0.1).collect();
        let quiet = rng.usize(..errors.len());
        let force = |ms: f64| match ms as usize {
            0 => 1.0,
            at if at < quiet => 2.0 + errors[at],
            at => 2.0 + 0.1 * errors[at],
        };
        let measured = pressed(2_000, errors.len(), force);
        let outside = |ms: usize| (force(ms as f64) - 2.0).abs() > 0.02;
        match measured.get("settling_ms") {
            None => assert!(outside(errors.len() - 1)),
            Some(ms) => {
                let at = ms.round() as usize;
                assert!(!(at..errors.len()).any(outside) && outside(at - 1), "{at} of {}", errors.len());
                settled += 1;
            }
        }
        let highest_n = (0..errors.len()).map(|ms| force(ms as f64)).fold(2.0, f64::max);
        close(&measured, "overshoot_percent", 100.0 * (highest_n - 2.0));
    }
    assert!(settled > 1_000, "{settled}");
}
