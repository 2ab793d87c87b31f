//! Jog and strokes on drawn drives, in free air and with an object in their way.

use crate::{drawn, fingers_or, population, print_worst, rows};
use fingertip::measure::{Ended, MeasureState, MeasureStatus, Task};
use fingertip::params::Params;
use fingertip::shipped::Config;
use sim::cores;
use sim::effects::Named;
use sim::native::bench::Bench;
use sim::plant::Faults;
use sim::population::{Finger, Population};
use sim::scene::Scene;
use sim::setup::Setup;

const DRIVES: &str = include_str!("drives.toml");
/// Limits of the motions at the tip: distance from the origin, and force.
const TRAVEL_MM: f64 = 1.6;
const FORCE_N: f64 = 0.3;

/// One motion, and the largest true distance and force.
struct Made {
    standing: MeasureStatus,
    rows: u32,
    travel_mm: f64,
    force_n: f64,
    took_s: f64,
}

fn make(scene: &Scene, task: Task) -> Made {
    let mut bench = Bench::<Named>::new(scene).expect("a world");
    bench.tare();
    bench.command().torque = false;
    let begun_s = bench.time_s();
    let begun_mm = bench.truth().travel_mm;
    let (mut travel_mm, mut force_n) = (0.0_f64, 0.0_f64);
    let standing = bench.measure(task, |bench| {
        let truth = bench.truth();
        travel_mm = travel_mm.max((truth.travel_mm - begun_mm).abs());
        force_n = force_n.max(truth.force_n);
    });
    let rows = if task == Task::Jog { 0 } else { rows(bench.kept(), standing.ended as u8) };
    Made { standing, rows, travel_mm, force_n, took_s: bench.time_s() - begun_s }
}

fn drives(count: usize, task: Task, changes: &[(&str, &str)]) -> Vec<(Finger, Made)> {
    let text = changes.iter().fold(DRIVES.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    let drives: Population = population("drives.toml", &text);
    let fingers = (0..count).map(|number| drives.finger(1, number).unwrap_or_else(|errors| panic!("{errors}")));
    let fingers: Vec<Finger> = fingers.collect();
    let made = cores::map(0..count, |number| make(&fingers[number].scene, task));
    fingers.into_iter().zip(made).collect()
}

/// Prints the worst cases and the endings, and checks the limits; returns how many completed.
fn judge(name: &str, made: &[(Finger, Made)]) -> usize {
    let all = |of: fn(&Made) -> f64| made.iter().enumerate().map(|(number, (_, made))| (of(made), number)).collect();
    println!("{name}:");
    for (number, (finger, made)) in made.iter().enumerate() {
        let MeasureStatus { ended, value, progress, .. } = made.standing;
        if ended != Ended::Complete {
            println!(
                "  drive {number}: {ended:?} {value} after {:.2} s, {progress} %; friction {:.2} %, {:.0} % more at rest, {:.0} counts",
                made.took_s,
                drawn(finger, "friction_percent"),
                100.0 * drawn(finger, "stiction"),
                drawn(finger, "motor.encoder_counts_per_turn"),
            );
        }
    }
    let travel_mm = print_worst("  travel, mm", all(|made| made.travel_mm));
    let force_mn = print_worst("  force, mN", all(|made| 1e3 * made.force_n));
    print_worst("  time, s", all(|made| made.took_s));
    print_worst("  rows", all(|made| made.rows.into()));
    let done = made.iter().filter(|(_, made)| made.standing.state == MeasureState::Done).count();
    println!("  {done} of {} complete", made.len());
    assert!(travel_mm < TRAVEL_MM && force_mn < 1e3 * FORCE_N, "{name}: {travel_mm} mm, {force_mn} mN");
    done
}

#[test]
fn strokes_in_free_air_stay_near_the_origin_and_complete() {
    complete_in_free_air(8);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_strokes_in_free_air_stay_near_the_origin_and_complete() {
    complete_in_free_air(fingers_or(40));
}

fn complete_in_free_air(count: usize) {
    let made = drives(count, Task::Strokes, &[]);
    let done = judge("free air", &made);
    assert!(10 * done >= 9 * made.len(), "{done}");
}

#[test]
fn jogs_complete() {
    let made = drives(fingers_or(20), Task::Jog, &[("direction_confirmed = 1", "direction_confirmed = 0")]);
    let done = judge("jogs", &made);
    assert!(10 * done >= 9 * made.len(), "{done}");
}

/// An object from 0.1 to 1.2 mm ahead, seen by the array or off it.
#[test]
fn an_object_in_the_way_is_pressed_with_no_more_than_300_mn() {
    stop_at_an_object(4);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_an_object_in_the_way_is_pressed_with_no_more_than_300_mn() {
    stop_at_an_object(fingers_or(20));
}

fn stop_at_an_object(count: usize) {
    let near = ("distance_mm = { uniform = [2, 8] }", "distance_mm = { uniform = [0.1, 1.2] }");
    let off = ("centre_x_mm = { uniform = [-3.5, 3.5] }", "centre_x_mm = 20");
    judge("an object ahead", &drives(count, Task::Strokes, &[near]));
    judge("an object ahead, off the array", &drives(count, Task::Strokes, &[near, off]));
}

/// The tip must not go far before the strokes end.
#[test]
fn strokes_of_a_broken_drive_end_near_the_origin() {
    let params = Params { direction_confirmed: 1, ..Params::DEFAULT };
    let config = Config::shipped(&params).expect("they are allowed");
    type Case = (fn(&mut Faults), &'static [Ended]);
    let cases: [Case; 5] = [
        (|faults| faults.encoder_reversed = true, &[Ended::Reversed]),
        (|faults| faults.leads_swapped = true, &[Ended::Reversed]),
        (|faults| faults.encoder_frozen = true, &[Ended::Still]),
        (|faults| faults.end_stops_mm = Some([-0.1, 5.0]), &[Ended::Pushed, Ended::Still]),
        (|faults| faults.end_stops_mm = Some([-5.0, 0.1]), &[Ended::Pushed, Ended::Still]),
    ];
    for (number, (broken, ends)) in cases.into_iter().enumerate() {
        let mut bench = Bench::of(&Setup::default(), &config);
        bench.harm(broken);
        bench.tare();
        bench.command().torque = false;
        let mut travel_mm = 0.0_f64;
        let standing = bench.measure(Task::Strokes, |bench| travel_mm = travel_mm.max(bench.truth().travel_mm.abs()));
        let fault = bench.status().fault;
        println!("case {number}: {:?} {} {fault:?}, {travel_mm:.2} mm", standing.ended, standing.value);
        assert!(travel_mm < TRAVEL_MM && (ends.contains(&standing.ended) || fault.is_some()));
    }
}
