//! Events: each kind has its described effect, repeatably, and one without magnitude changes no bit.

use crate::*;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::state::{Fault, Mode};
use sim::metrics::Measured;
use sim::run::{Outcome, run};
use sim::watch::{Agreement, Path};

struct Kept {
    time_s: f64,
    truth: Truth,
    sense: Sense,
    command: Command,
    status: Status,
    codes: [[u16; COLUMNS]; ROWS],
}

#[derive(Default)]
struct All(Vec<Kept>);

impl Watch for All {
    fn step(&mut self, step: &Step) {
        let Step { time_s, truth, sense, command, status, frame, .. } = *step;
        let codes = core::array::from_fn(|row| core::array::from_fn(|column| frame.code(row, column)));
        let (truth, sense, command, status) = (*truth, *sense, *command, *status);
        self.0.push(Kept { time_s, truth, sense, command, status, codes });
    }
}

impl All {
    /// The first step at a time or later.
    fn at(&self, time_s: f64) -> &Kept {
        self.0.iter().find(|kept| kept.time_s >= time_s).expect("the run is that long")
    }
}

/// Runs a finger that holds 1 N from 0.1 s on, with events and other tables.
fn run_with(events: &str) -> (Outcome, All) {
    let head =
        "duration_s = 1.0\n[object]\ndistance_mm = 2\n[effects.dry_friction]\n[[script]]\nat_s = 0\ngoal_n = 1\n";
    let mut all = All::default();
    let outcome = run(&scene(&format!("{head}{events}")), &native::board, &mut [&mut all]).unwrap();
    (outcome, all)
}

fn event(kind: &str, keys: &str) -> String {
    format!("[[event]]\nat_s = 0.4\nkind = \"{kind}\"\n{}\n", keys.replace(", ", "\n"))
}

/// The run with one event at 0.4 s.
fn with(kind: &str, keys: &str) -> All {
    run_with(&event(kind, keys)).1
}

#[test]
fn each_event_without_magnitude_changes_no_bit_and_each_event_repeats() {
    let plain = run_with("").0.summary.digest;
    let swing = "rate_hz = 5, for_s = 0.4, amplitude_mm = ";
    let taxel = "row = 4, column = 4, to_codes = 9, for_s = ";
    for (kind, zero, some) in [
        ("object_move", "by_mm = 0, speed_mm_per_s = 1", "by_mm = -0.3, speed_mm_per_s = 10"),
        ("object_oscillate", &format!("{swing}0"), &format!("{swing}0.1")),
        ("object_removed", "for_s = 0", "for_s = 0.1"),
        ("encoder_slip", "by_counts = 0", "by_counts = 9"),
        ("brown_out", "to_v = 6, for_s = 0.1", "to_v = 5, for_s = 0.1"),
        ("taxel_stuck", &format!("{taxel}0"), &format!("{taxel}0.1")),
        ("row_stuck", "row = 4, to_codes = 9, for_s = 0", "row = 4, to_codes = 9, for_s = 0.1"),
        ("gain_change", "factor = 1, for_s = 0.1", "factor = 0.9, for_s = 0.1"),
        ("array_blank", "for_s = 0", "for_s = 0.1"),
        ("interference", "for_s = 0", "for_s = 0.001"),
        ("host_silent", "for_s = 0", "for_s = 0.1"),
    ] {
        let digest = |keys: &str| run_with(&event(kind, keys)).0.summary.digest;
        assert_eq!(digest(zero), plain, "{kind} {zero}");
        let once = digest(some);
        assert_ne!(once, plain, "{kind} {some}");
        assert_eq!(digest(some), once, "{kind} {some}");
    }
}

#[test]
fn the_object_moves_and_the_finger_follows_it() {
    let before_mm = run_with("").1.at(0.9).truth.travel_mm;
    for by_mm in [-0.5, 0.7] {
        let all = with("object_move", &format!("by_mm = {by_mm}, speed_mm_per_s = 10"));
        let Truth { travel_mm, force_n, .. } = all.at(0.9).truth;
        assert!((travel_mm - before_mm - by_mm).abs() < 0.02, "{by_mm}: {travel_mm}");
        assert!((force_n - 1.0).abs() < 0.05);
    }
    let all = with("object_oscillate", "amplitude_mm = 0.2, rate_hz = 5, for_s = 0.3");
    let [near_mm, far_mm] = [0.55, 0.45].map(|time_s| all.at(time_s).truth.travel_mm);
    assert!((far_mm - near_mm - 0.4).abs() < 0.1, "{near_mm} to {far_mm} at the two peaks of the second half period");
    assert!((all.at(0.9).truth.travel_mm - before_mm).abs() < 0.02, "after one whole period it is where it was");
}

#[test]
fn an_object_that_was_taken_away_comes_back_to_its_place() {
    let all = with("object_removed", "for_s = 0.1");
    assert_eq!([0.41, 0.49].map(|time_s| all.at(time_s).truth.force_n), [0.0; 2]);
    let gone_mm = all.at(0.5).truth.travel_mm - all.at(0.39).truth.travel_mm;
    assert!(gone_mm < -0.3, "a force that vanishes at once makes the finger back off: {gone_mm}");
    let [held, back] = [0.39, 0.95].map(|time_s| all.at(time_s).truth);
    assert!((back.travel_mm - held.travel_mm).abs() < 0.05 && (back.force_n - 1.0).abs() < 0.1);
}

#[test]
fn requests_reach_the_controller() {
    let all = with("torque_off", "for_s = 0.2");
    assert_eq!([0.39, 0.41, 0.59, 0.61].map(|time_s| all.at(time_s).command.torque), [true, false, false, true]);
    assert_eq!((all.at(0.5).status.mode, all.at(0.99).status.mode), (Mode::Off, Mode::Force));
    assert_eq!(with("tare", "").at(0.422).status.tare, fingertip::pipeline::Taring::Refused, "the tip is pressed");
    // The later recovery clears the fault.
    let recover = event("recover", "").replace("0.4", "0.7");
    let (_, all) = run_with(&format!("{}{recover}", event("row_stuck", "row = 2, to_codes = 3000, for_s = 0.2")));
    assert_eq!(with("brown_out", "to_v = 2, for_s = 0.05").at(0.99).status.fault, Some(Fault::SupplyLow));
    assert_eq!((all.at(0.5).status.fault, all.at(0.99).status.fault), (all.at(0.69).status.fault, None));
}

#[test]
fn a_silent_host_trips_the_watchdog() {
    let silent = event("host_silent", "for_s = 0.2");
    let (outcome, all) = run_with(&format!("{silent}[host]\nwatchdog_ms = 50\n"));
    assert!(all.at(0.44).sense.bus_silent_ms >= 30 && all.at(0.65).sense.bus_silent_ms < 20);
    assert_eq!(all.at(0.9).status.fault, Some(Fault::BusSilent));
    // The silence explains the fault, so that it does not count.
    assert_eq!(["faults_count", "fault_number"].map(|metric| outcome.measured.get(metric)), [Some(0.0), Some(7.0)]);
}

#[test]
fn encoder_and_supply_fail_as_they_are_told_to() {
    let plain = run_with("").1;
    let slipped = with("encoder_slip", "by_counts = 30").at(0.4).sense.encoder - plain.at(0.4).sense.encoder;
    assert!((28..=32).contains(&slipped), "{slipped}");
    let all = with("brown_out", "to_v = 4, for_s = 0.1");
    assert_eq!([0.39, 0.45, 0.51].map(|time_s| all.at(time_s).truth.supply_v), [6.0, 4.0, 6.0]);
}

#[test]
fn the_array_shows_what_its_defect_says() {
    let plain = run_with("").1;
    let sum = |kept: &Kept| kept.codes.iter().flatten().map(|code| f64::from(*code)).sum::<f64>();
    let [rest, held] = [0.0, 0.39].map(|time_s| sum(plain.at(time_s)));
    let all = with("taxel_stuck", "row = 4, column = 6, to_codes = 77, for_s = 0.1");
    assert_eq!((all.at(0.405).codes[4][6], all.at(0.405).codes[6][4] == 77), (77, false));
    assert_ne!(all.at(0.51).codes[4][6], 77);
    let all = with("row_stuck", "row = 3, to_codes = 1234, for_s = 0.1");
    assert_eq!(all.at(0.401).codes[3], [1234; COLUMNS]);
    let share = (sum(with("gain_change", "factor = 0.5, for_s = 0.1").at(0.4001)) - rest) / (held - rest);
    assert!((share - 0.5).abs() < 0.03, "{share}");
    assert_eq!(sum(with("array_blank", "for_s = 0.1").at(0.401)), rest);
    let all = run_with(&event("array_frozen", "for_s = 0.1").replace("0.4", "0.06")).1.0;
    let frozen = all.iter().filter(|kept| (0.0605..0.159).contains(&kept.time_s));
    assert!(frozen.clone().all(|kept| kept.codes == frozen.clone().next().unwrap().codes));
    let all = with("interference", "for_s = 0.01");
    assert!((sum(all.at(0.405)) / 1e2 - 2048.0).abs() < 500.0 && all.at(0.405).codes != all.at(0.406).codes);
}

#[test]
fn two_boards_are_not_compared_where_codes_are_random() {
    for (kind, unjudged) in [("interference", true), ("array_blank", false)] {
        let scene = scene(&format!("duration_s = 1.0\n{}", event(kind, "for_s = 0.1")));
        assert_eq!(Agreement::new(&scene, Path::default()).held(), unjudged, "{kind}: nothing was compared");
    }
}

#[test]
fn an_event_restarts_the_judgement_of_a_hold_and_a_missing_object_is_not_missed() {
    let value = |measured: &Measured, metric: &str| measured.get(metric).unwrap();
    let away = run_with(&event("object_removed", "for_s = 0.6")).0.measured;
    assert_eq!(["touches_missed_count", "hold_error_mn"].map(|metric| value(&away, metric)), [0.0; 2]);
    // Half the gain doubles the force, which counts as a defect with its own bound.
    let (outcome, _) = run_with(&event("gain_change", "factor = 0.5, for_s = 0.6"));
    assert!(value(&outcome.measured, "over_force_defective_mn") > 50.0);
    assert!(value(&outcome.measured, "over_force_mn") < 100.0);
}
