//! Metrics and bounds.

use crate::wall;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::Frame;
use fingertip::state::Fault;
use sim::metrics::{self, METRICS, Meter};
use sim::run::run;
use sim::scene::Bound;
use sim::watch::{Step, Truth, Watch};
use sim::{ledger, native};
use std::collections::BTreeSet;

#[test]
fn every_metric_has_a_name_with_a_unit_and_stands_once() {
    let units =
        ["n", "mn", "ms", "mm", "mm_per_s", "percent", "count", "um", "number", "j", "a", "c", "dropped", "broken"];
    let names = metrics::names();
    assert_eq!(names.len(), 3 * METRICS.len());
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    for name in names {
        assert!(units.iter().any(|unit| name.ends_with(&format!("_{unit}")) || name.ends_with(unit)), "{name}");
    }
    assert_eq!(metrics::page().lines().count(), 2 + METRICS.len());
}

#[test]
fn the_wall_is_measured() {
    let scene = wall();
    let outcome = run(&scene, &native::board, &mut []).unwrap();
    let value = |name: &str| outcome.measured.get(name).unwrap_or_else(|| panic!("no {name}"));
    assert!((0.99..1.05).contains(&value("peak_force_n")), "{}", value("peak_force_n"));
    assert!((0.0..5.0).contains(&value("overshoot_percent")));
    assert!((29.0..31.0).contains(&value("approach_mm_per_s")), "{}", value("approach_mm_per_s"));
    assert!((160.0..220.0).contains(&value("touch_ms")), "{}", value("touch_ms"));
    assert!((1.0..30.0).contains(&value("settling_ms")), "{}", value("settling_ms"));
    assert!((0.01..10.0).contains(&value("steady_error_max_mn")));
    assert!(value("steady_error_rms_mn") <= value("steady_error_max_mn") * (1.0 + 1e-12));
    assert!((0.001..0.2).contains(&value("energy_j")), "{}", value("energy_j"));
    assert!(value("confidence_min_percent") > 50.0, "{}", value("confidence_min_percent"));
    assert_eq!(value("finger0.peak_force_n"), value("peak_force_n"));
    assert_eq!(value("faults_count"), 0.0);
    assert_eq!(value("missed_frames_count"), 0.0);
    assert_eq!(value("winding_max_c"), 25.0);
    assert!(outcome.measured.get("fault_ms").is_none() && outcome.measured.get("slip_noticed_ms").is_none());
    assert!(outcome.passed(), "{}", outcome.text());
}

#[test]
fn of_two_fingers_faults_the_first_in_time_is_the_scenes() {
    // Each finger's fault and when it comes, if it does.
    let measure = |fingers: [Option<(Fault, f64)>; 2]| {
        let mut meter = Meter::default();
        for (finger, tenth) in (0..10).flat_map(|tenth| [(0, tenth), (1, tenth)]) {
            let time_s = f64::from(tenth) * 0.1;
            let fault = fingers[finger].filter(|(_, at_s)| time_s >= *at_s).map(|(fault, _)| fault);
            let status = Status { fault, ..Status::default() };
            let (frame, sense, command, truth) =
                (&Frame::EMPTY, &Sense::default(), &Command::default(), &Truth::default());
            meter.step(&Step { finger, time_s, frame, sense, command, status: &status, truth });
        }
        let measured = meter.measured();
        ["fault_number", "fault_ms", "faults_count"].map(|name| measured.get(name))
    };
    let (low, high) = (Fault::ArrayBroken, Fault::SupplyLow);
    let number = |fault: Fault| Some(f64::from(fault as u8));
    assert!(number(low) < number(high));
    for (first, second) in [(low, high), (high, low)] {
        let expected = [number(first), Some(1e3 * 0.3), Some(2.0)];
        let close = |measured: [Option<f64>; 3]| {
            measured.iter().zip(expected).all(|(a, b)| (a.unwrap() - b.unwrap()).abs() < 1e-9)
        };
        assert!(close(measure([Some((first, 0.25)), Some((second, 0.6))])));
        assert!(close(measure([Some((second, 0.6)), Some((first, 0.25))])));
    }
    let alone = measure([None, Some((high, 0.25))]);
    assert!(alone[0] == number(high) && alone[1].is_some() && alone[2] == Some(1.0), "{alone:?}");
    assert_eq!(measure([None, None]), [Some(0.0), None, Some(0.0)]);
}

/// As where nothing grows with the goal: what one finger lacks, the other does not make up for.
#[test]
fn of_two_fingers_one_without_a_value_breaks_what_grows_with_the_goal() {
    let mut meter = Meter::default();
    // Only the first is asked for a force.
    for (step, (finger, goal_mn)) in (0..600).flat_map(|step| [(step, (0, 1_000)), (step, (1, 0))]) {
        let command = Command { goal: newtons(goal_mn), ..Command::default() };
        let truth = Truth { force_n: f64::from(goal_mn) * 1e-3, ..Truth::default() };
        let (frame, sense, status) = (&Frame::EMPTY, &Sense::default(), &Status::default());
        let time_s = f64::from(step) * 1e-3;
        meter.step(&Step { finger, time_s, frame, sense, command: &command, status, truth: &truth });
    }
    let bound = |metric: &str| Bound { metric: metric.into(), min: None, max: Some(50.0), max_per_goal_n: Some(100.0) };
    let bounds = ["hold_swing_mn", "finger0.hold_swing_mn", "finger1.hold_swing_mn"].map(bound);
    let verdicts = meter.verdicts(&bounds);
    let values: Vec<_> = verdicts.iter().map(|verdict| (verdict.value, verdict.held)).collect();
    assert_eq!(values, [(None, false), (Some(0.0), true), (None, false)]);
}

#[test]
fn a_bound_breaks_on_either_side_and_without_a_value() {
    let mut scene = wall();
    let bound = |metric: &str, min, max| Bound { metric: metric.into(), min, max, max_per_goal_n: None };
    scene.bounds = vec![
        bound("peak_force_n", Some(1.2), None),
        bound("peak_force_n", None, Some(0.9)),
        bound("peak_force_n", Some(0.9), Some(1.2)),
        bound("slip_noticed_ms", None, Some(10.0)),
    ];
    let outcome = run(&scene, &native::board, &mut []).unwrap();
    let held: Vec<bool> = outcome.verdicts.iter().map(|verdict| verdict.held).collect();
    assert_eq!(held, [false, false, true, false]);
    assert!(!outcome.passed());
    let text = outcome.text();
    assert!(text.contains("BROKEN peak_force_n") && text.contains("1.2 or more asked"), "{text}");
    let json = outcome.json(&scene, "native", &[]);
    assert_eq!(json["passed"], false);
    assert_eq!(json["bounds"][3]["value"], serde_json::Value::Null);
    assert_eq!(json["ledger"][0]["effect"], "row_sag");
    assert_eq!(json["seed"], 1);
}

#[test]
fn an_ablation_shows_what_an_effect_changes() {
    let scene = wall();
    let whole = run(&scene, &native::board, &mut []).unwrap();
    let ablated = ledger::ablate(&scene, &native::board).unwrap();
    assert_eq!(ablated.iter().map(|without| without.effect).collect::<Vec<_>>(), ["row_sag"]);
    let rows = ledger::differences(&whole.measured, &ablated);
    assert!(rows.iter().any(|(name, ..)| *name == "force_error_rms_mn"));
    assert!(rows.iter().all(|(name, ..)| *name != "winding_max_c"));
    let text = ledger::ablation_text(&whole.measured, &ablated);
    assert!(text.contains("row_sag") && text.contains("force_error_rms_mn"), "{text}");
}

#[test]
fn values_are_shown_with_the_digits_that_count() {
    let shown = |value| metrics::shown(Some(value));
    assert_eq!(shown(0.0), "0");
    assert_eq!(shown(1.0), "1");
    assert_eq!(shown(1.234_567_8), "1.2346");
    assert_eq!(shown(-123_456.7), "-123457");
    assert_eq!(shown(1.234_567e-4), "0.00012346");
    assert_eq!(metrics::shown(None), "none");
}
