//! The figures of a run against traces made by hand, whose figures are known.

use fingertip::state::Mode;
use host_tests::metrics::{self, DriveLimits, MetricsError, Sample};
use host_tests::plant::Setup;
use proptest::prelude::*;

const LIMITS: DriveLimits = DriveLimits { volts: 6.0, amperes: 2.0 };

/// A sample a ms, the force a function of the time in ms.
fn trace(goal_n: f64, samples: usize, force_n: impl Fn(f64) -> f64) -> Vec<Sample> {
    let at = |ms: usize| {
        let true_force_n = force_n(ms as f64);
        Sample { time_s: ms as f64 * 1e-3, goal_n, true_force_n, mode: Mode::Force, ..Sample::default() }
    };
    (0..samples).map(at).collect()
}

#[track_caller]
fn close(measured: f64, expected: f64) {
    assert!((measured - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{measured} instead of {expected}");
}

#[test]
fn a_ramp_rises_in_eight_tenths_of_its_time() {
    let ramp = trace(2.0, 300, |ms| 1.0 + (ms / 20.0).min(1.0));
    let step = metrics::step(&ramp, &Setup::default(), LIMITS).unwrap();
    close(step.from_n, 1.0);
    close(step.to_n, 2.0);
    close(step.rise_ms, 16.0);
    close(step.overshoot_percent, 0.0);
    close(step.steady_error_mn, 0.0);
    // 98 % of the step would be 19.6 ms: the first sample inside is that of 20 ms.
    close(step.settling_ms.unwrap(), 20.0);
    let bound = host_tests::optimal::minimum_time_s(
        &Setup::default(),
        Setup::default().tip.indentation_mm(1.0),
        Setup::default().tip.indentation_mm(2.0),
        6.0,
        2.0,
    );
    close(step.time_optimal_ms, bound.unwrap() * 1e3);
    close(step.settling_to_optimal_ratio.unwrap(), 20.0 / step.time_optimal_ms);
}

#[test]
fn overshoot_and_settling_take_the_smaller_of_goal_and_step() {
    // Down from 5 N to 1 N, 30 mN beyond: 3 % of the goal, though only 0.75 % of the step.
    let down = trace(1.0, 300, |ms| {
        if ms < 5.0 {
            5.0
        } else if ms < 50.0 {
            0.97
        } else {
            1.0
        }
    });
    let step = metrics::step(&down, &Setup::default(), LIMITS).unwrap();
    close(step.overshoot_percent, 3.0);
    close(step.settling_ms.unwrap(), 50.0);
    // Up from 4 N to 5 N, 30 mN beyond: 3 % of the step, though only 0.6 % of the goal.
    let up = trace(5.0, 300, |ms| {
        if ms < 5.0 {
            4.0
        } else if ms < 50.0 {
            5.03
        } else {
            5.0
        }
    });
    let step = metrics::step(&up, &Setup::default(), LIMITS).unwrap();
    close(step.overshoot_percent, 3.0);
    close(step.settling_ms.unwrap(), 50.0);
}

#[test]
fn an_error_that_stays_is_a_steady_error() {
    let off = trace(2.0, 300, |ms| if ms < 10.0 { 1.0 } else { 1.99 });
    let step = metrics::step(&off, &Setup::default(), LIMITS).unwrap();
    close(step.steady_error_mn, 10.0);
    // One sample off before 100 ms does not count, one after does.
    let spike = |at_ms: f64| {
        trace(2.0, 300, move |ms| {
            if ms == at_ms {
                2.05
            } else if ms < 10.0 {
                1.0
            } else {
                2.0
            }
        })
    };
    close(metrics::step(&spike(99.0), &Setup::default(), LIMITS).unwrap().steady_error_mn, 0.0);
    let late = metrics::step(&spike(101.0), &Setup::default(), LIMITS).unwrap();
    close(late.steady_error_mn, 50.0);
    close(late.settling_ms.unwrap(), 102.0);
}

#[test]
fn what_never_settles_has_no_settling_time() {
    let swinging = trace(2.0, 301, |ms| if ms == 0.0 { 1.0 } else { 2.0 + if ms % 2.0 == 0.0 { 0.1 } else { -0.1 } });
    let step = metrics::step(&swinging, &Setup::default(), LIMITS).unwrap();
    assert_eq!((step.settling_ms, step.settling_to_optimal_ratio), (None, None));
    close(step.overshoot_percent, 10.0);
}

#[test]
fn a_touch_is_timed_from_goal_and_from_contact() {
    // 5 mm at 25 mm/s: touches after 200 ms, rises to 1.08 N within 10 ms, holds 1 N from 30 ms after the touch.
    let mut touching = trace(1.0, 500, |ms| match ms - 200.0 {
        since if since <= 0.0 => 0.0,
        since if since < 10.0 => 0.1 * since,
        since if since < 30.0 => 1.08,
        _ => 1.0,
    });
    for sample in &mut touching {
        sample.travel_mm = 0.3 + (sample.time_s * 25.0).min(5.5);
    }
    let touch = metrics::touch(&touching).unwrap();
    close(touch.touched_after_ms, 201.0);
    close(touch.approach_mm_per_s, 25.0);
    close(touch.distance_mm, 5.025);
    close(touch.peak_n, 1.08);
    close(touch.peak_above_goal_percent, 8.0);
    close(touch.settled_after_touch_ms.unwrap(), 29.0);
    close(touch.steady_error_mn, 0.0);
}

#[test]
fn traces_without_figures_say_why() {
    assert_eq!(metrics::touch(&trace(1.0, 100, |_| 0.0)), Err(MetricsError::NoTouch));
    assert!(matches!(metrics::touch(&[]), Err(MetricsError::TooShort { .. })));
    let stuck = metrics::step(&trace(2.0, 300, |_| 1.0), &Setup::default(), LIMITS);
    assert_eq!(stuck, Err(MetricsError::NoRise { from_n: 1.0, to_n: 2.0 }));
    let weak = DriveLimits { volts: 0.1, amperes: 2.0 };
    let step = metrics::step(&trace(2.0, 300, |ms| 1.0 + (ms / 20.0).min(1.0)), &Setup::default(), weak);
    assert!(matches!(step, Err(MetricsError::Unreachable(_))), "{step:?}");
}

proptest! {
    /// Whatever the force does: after the settling time it is inside the band, and just before it was outside.
    #[test]
    fn settling_is_the_last_entry_into_the_band(errors in prop::collection::vec(-0.1..0.1, 20..200)) {
        let force = |ms: f64| if ms == 0.0 { 1.0 } else { 2.0 + errors[ms as usize] };
        let samples = trace(2.0, errors.len(), force);
        let step = metrics::step(&samples, &Setup::default(), LIMITS).unwrap();
        let outside = |sample: &Sample| (sample.true_force_n - 2.0).abs() > 0.02;
        match step.settling_ms {
            None => prop_assert!(outside(samples.last().unwrap())),
            Some(ms) => {
                let at = ms.round() as usize;
                prop_assert!(!samples[at..].iter().any(outside));
                prop_assert!(outside(&samples[at - 1]));
            }
        }
        prop_assert!(step.overshoot_percent >= 0.0 && step.overshoot_percent <= 10.0);
    }

    /// A stretch has all samples of its time and no other.
    #[test]
    fn a_stretch_is_cut_by_time(from in 0_usize..120, length in 0_usize..120) {
        let samples = trace(1.0, 100, |_| 1.0);
        let (from_s, to_s) = (from as f64 * 1e-3 - 1e-4, (from + length) as f64 * 1e-3 - 1e-4);
        let cut = metrics::stretch(&samples, from_s, to_s);
        prop_assert_eq!(cut.len(), (from + length).min(100).saturating_sub(from.min(100)));
        prop_assert!(cut.iter().all(|sample| (from_s..to_s).contains(&sample.time_s)));
    }
}
