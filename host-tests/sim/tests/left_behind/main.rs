//! Results of a run: metrics, ledger, recording, report, sweep.
//!
//! The report is tested as text here; `cargo xtask test` shows it in a browser. The metrics of a step response are
//! tested with synthetic forces, whose figures are known.

mod recorded;
mod swept;

use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::Frame;
use fingertip::state::Fault;
use sim::metrics::{self, METRICS, Measured, Meter, Verdict};
use sim::report::{Over, Report, Trace, page};
use sim::run::{self, run};
use sim::scene::{Bound, Scene};
use sim::watch::{Step, Truth, Watch};
use sim::{cli, native};
use std::collections::BTreeSet;

/// A wall with one effect.
const SCENE: &str = concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/tests/left_behind/wall.toml");

fn wall() -> Scene {
    cli::load(SCENE, &[], None).unwrap()
}

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
    // Fault of each finger and its time, if there is one.
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

/// As for a bound that does not grow with the goal: a missing value of one finger is not replaced by that of the other.
#[test]
fn of_two_fingers_one_without_a_value_breaks_what_grows_with_the_goal() {
    let mut meter = Meter::default();
    // Only the first has a goal.
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
    let ablated = run::ablate(&scene, &native::board).unwrap();
    assert_eq!(ablated.iter().map(|without| without.effect).collect::<Vec<_>>(), ["row_sag"]);
    let rows = run::differences(&whole.measured, &ablated);
    assert!(rows.iter().any(|(name, ..)| *name == "force_error_rms_mn"));
    assert!(rows.iter().all(|(name, ..)| *name != "winding_max_c"));
    let text = run::ablation_text(&whole.measured, &ablated);
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

/// Library that draws the plots, after its licence.
const LIBRARY: &str =
    include_str!(concat!(env!("FINGERTIP_ROOT"), "/host-tests/sim/src/report/uplot/uPlot.iife.min.js"));

#[test]
fn a_report_stands_alone_and_has_every_part() {
    let mut scene = wall();
    scene.about = "A <b>wall</b> & more".into();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let ablated = run::ablate(&scene, &native::board).unwrap();
    let page = page(&Report {
        scene: &scene,
        board: "native",
        outcome: &outcome,
        trace: &trace,
        ablated: &ablated,
        over: None,
    });
    let page = page.unwrap();
    for part in ["bounds", "plots", "metrics", "ledger", "ablation", "scene"] {
        assert!(page.contains(&format!("<section id=\"{part}\">")), "{part}");
    }
    assert!(page.contains("A &lt;b&gt;wall&lt;/b&gt; &amp; more") && !page.contains("<b>wall"));
    assert!(page.contains("Simulated") && page.contains("row_sag") && page.contains("[[expect]]"));
    // The control error is drawn to the scale of the holds: the approach is off by the whole goal.
    let plots = &trace.fingers[0];
    let [[low, high], held] = [&plots.control_error, &plots.held_error].map(|track| track.ends().unwrap());
    assert!(low < -900.0 && high < 100.0 && held[0] > -50.0 && held[1] < 50.0, "{low} to {high}, held {held:?}");
    assert!(page.contains("the axis fits the holds"));
    // Nothing is fetched, and nothing may be: the only addresses are XML's names, and the library's of itself.
    assert!(page.contains("content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'\""));
    assert_eq!(page.matches(LIBRARY).count(), 1);
    let fetched = page.replace(LIBRARY, "").replace("http://www.w3.org/2000/svg", "");
    for address in ["http:", "https:", "src=", "href=", "url(", "@import"] {
        assert!(!fetched.contains(address), "{address}");
    }
    // Every picture has a description.
    let pictures: Vec<&str> = page.split(" role=\"img\"").skip(1).collect();
    assert!(pictures.len() > 20, "{} pictures", pictures.len());
    assert!(pictures.iter().all(|tag| tag.split('>').next().unwrap().contains(" aria-label=\"")));
    assert_eq!(page.matches("Pressure map at").count(), 10);
    let instants = &trace.fingers[0].instants;
    assert_eq!(instants.len(), 150);
    assert!(instants.iter().any(|at| at.true_kpa.iter().flatten().any(|kpa| *kpa > 10.0)));
    assert!(instants.iter().any(|at| at.codes.iter().flatten().any(|code| *code > 100)));
    // Stretches and maps bound its size for any length of a run.
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    if let Some(path) = std::env::var_os("FINGERTIP_REPORT") {
        std::fs::write(path, page).unwrap();
    }
}

#[test]
fn what_is_broken_comes_first_and_the_rest_is_folded() {
    let scene = cli::load(crate::SCENE, &["duration_s=0.05".into()], None).unwrap();
    assert_eq!(scene.set, ["duration_s=0.05"]);
    let mut trace = Trace::new(scene.duration_s);
    let mut outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let held = Verdict { held: true, ..outcome.verdicts[0].clone() };
    let mut broken = Verdict { held: false, ..held.clone() };
    broken.bound.metric = "energy_j".into();
    outcome.verdicts = vec![held, broken];
    let report = Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &[], over: None };
    let page = page(&report).unwrap();
    let at = |part: &str| page.find(part).unwrap_or_else(|| panic!("no {part}"));
    assert!(at("<code>duration_s=0.05</code>") < at("1 of 2 bounds broken"));
    assert!(at("1 of 2 bounds broken") < at("<code>energy_j</code>"));
    assert!(at("<code>energy_j</code>") < at("<details><summary>1 held</summary>"));
    let groups: Vec<&str> = page.split("<details class=\"group\"").skip(1).collect();
    assert!(groups.len() > 4 && groups[0].starts_with(" open><summary>Motor and energy"), "{}", &groups[0][..80]);
    assert!(groups[1..].iter().all(|group| group.starts_with("><summary>")));
}

#[test]
fn a_report_lies_over_another_whatever_the_scenes_are_called() {
    let mut scene = wall();
    scene.name = "</script><script>alert(1)</script><!--".into();
    scene.about = scene.name.clone();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    let page = |over| {
        page(&Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &[], over }).unwrap()
    };
    let alone = page(None);
    // Its data, the library, the scripts of the page.
    assert_eq!((alone.matches("<script").count(), alone.matches("</script>").count()), (3, 3));
    let over = Over::of(&alone).unwrap();
    let both = page(Some(&over));
    assert_eq!((both.matches("<script").count(), both.matches("</script>").count()), (4, 4));
    assert!(!both.contains("<!--"));
    // The page holds the data of the other run unchanged.
    let data =
        |page: &str, begin: &str| page.split_once(begin).unwrap().1.split_once("</script>").unwrap().0.to_owned();
    let [own, other] =
        ["run", "over"].map(|id| data(&both, &format!("<script type=\"application/json\" id=\"{id}\">")));
    assert_eq!(own, other);
    for (wrong, why) in [
        ("<p>a page</p>".to_owned(), "no report"),
        (alone.split_at(alone.find("\"fingers\"").unwrap() + 20).0.to_owned(), "cut off"),
        (alone.replace("id=\"run\">{", "id=\"run\">{{"), "damaged"),
        (alone.replace("\"format\":1,", "\"format\":99,"), "format 99, not 1"),
    ] {
        let error = Over::of(&wrong).unwrap_err();
        assert!(error.contains(why) && error.contains("--out"), "{error}");
    }
}

/// A step a ms, force and travel a function of the time in ms.
fn measured(goal_mn: i32, steps: usize, force_n: impl Fn(f64) -> f64, travel_mm: impl Fn(f64) -> f64) -> Measured {
    let mut meter = Meter::default();
    let command = Command { goal: newtons(goal_mn), ..Command::default() };
    for ms in (0..steps).map(|ms| ms as f64) {
        let truth = Truth { force_n: force_n(ms), travel_mm: travel_mm(ms), ..Truth::default() };
        let (frame, sense, status) = (&Frame::EMPTY, &Sense::default(), &Status::default());
        meter.step(&Step { finger: 0, time_s: ms * 1e-3, frame, sense, command: &command, status, truth: &truth });
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
fn what_never_settles_has_no_settling_time() {
    let swing = |ms: f64| if ms == 0.0 { 1.0 } else { 2.0 + if ms % 2.0 == 0.0 { 0.1 } else { -0.1 } };
    let swinging = pressed(2_000, 301, swing);
    assert_eq!(swinging.get("settling_ms"), None);
    close(&swinging, "overshoot_percent", 10.0);
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
        let overshoot = measured.get("overshoot_percent").expect("a touch");
        assert!((0.0..=10.0).contains(&overshoot), "{overshoot}");
    }
    assert!(settled > 1_000, "{settled}");
}
