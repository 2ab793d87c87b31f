//! Fingers under the controller: unusual orders of events at exact times, contacts that the array measures badly,
//! measuring motions, worn sensors, heat, and the bus.
//!
//! The tests judge the true state of the simulated finger. `cargo test -p sim --test fingers --
//! --nocapture` prints the largest value of each group of cases.

mod goals;
mod measure;
mod ordinary;
mod residues;
mod sequences;
mod served;
mod signal;

use fastrand::Rng;
use fingertip::config::newtons;
use fingertip::measure::Task;
use fingertip::params::Params;
use fingertip::shipped::{Config, Frame};
use fingertip::state::{Fault, Limits, Mode};
use images::record::Record;
use sim::native::{self, bench::Bench};
use sim::run::{Outcome, run};
use sim::scene::{Scene, read};
use sim::{cores, population};
use std::ops::Range;

/// A finger with the effects that its scene names.
type Finger = Bench;

/// Losses of the reference finger of `docs/runs.md`.
const LOSSES: &str = "[effects.dry_friction]\n[effects.gear_efficiency]\n[effects.supply_sag]\n";

/// Below this force nothing is touched, N.
const CONTACT_ON_N: f64 = Params::DEFAULT.contact_on_mn as f64 * 1e-3;

/// Speed of the approach, mm/s.
const APPROACH_MM_PER_S: f64 = Params::DEFAULT.approach_um_per_s as f64 * 1e-3;

/// Largest force allowed after an interruption of a press with this goal, N.
fn most_n(goal_n: f64) -> f64 {
    1.3 * goal_n + 0.5
}

/// Reads a scene from the tables of one finger.
fn scene(tables: &str) -> Scene {
    let text = format!("about = \"a finger\"\nduration_s = 1.0\n{tables}\n[[script]]\nat_s = 0.0\ngoal_n = 0.0\n");
    read("test.toml", &text).unwrap_or_else(|errors| panic!("{errors}\n{text}"))
}

/// A finger that is tared; its torque is on from the next frame.
fn finger(tables: &str) -> Finger {
    begun(&scene(tables))
}

/// The same from a scene.
fn begun(scene: &Scene) -> Finger {
    let mut finger = Bench::new(scene).unwrap_or_else(|error| panic!("{error}"));
    finger.tare();
    finger
}

/// Tables of an object in front of the tip that yields like a spring.
fn object(distance_mm: f64, yield_mm_per_n: f64) -> String {
    format!(
        "[object]\ndistance_mm = {distance_mm:?}\n[effects.object_stiffness]\nyield_mm_per_n = {yield_mm_per_n:?}\n"
    )
}

fn set_goal(finger: &mut Finger, goal_n: f64) {
    finger.command().goal = newtons((goal_n * 1e3).round() as i32);
}

/// Sets a goal and steps for a time; returns the largest true force meanwhile, N.
fn press(finger: &mut Finger, goal_n: f64, seconds: f64) -> f64 {
    set_goal(finger, goal_n);
    finger.run(seconds)
}

/// Turns torque off for a time and on again; returns the largest true force meanwhile, N.
fn interrupt_torque(finger: &mut Finger, seconds: f64) -> f64 {
    finger.command().torque = false;
    let largest_n = finger.run(seconds);
    finger.command().torque = true;
    largest_n
}

/// Replaces the codes of a frame and keeps its sequence number.
fn show(record: &mut Record, codes: &Frame) {
    record.frame = Frame { sequence: record.frame.sequence, ..*codes };
}

fn touch(finger: &mut Finger) {
    let until_s = finger.time_s() + 2.0;
    while finger.truth().force_n == 0.0 {
        let status = finger.status();
        assert!(finger.time_s() < until_s, "nothing is touched: {:?} {:?}", status.mode, status.fault);
        finger.step();
    }
}

/// Largest speed, mm/s, from 20 ms behind the end of the last contact on, in this time, s. A goal, N, is set at its time.
fn fastest_in_the_air(finger: &mut Finger, (at_s, goal_n): (f64, f64), seconds: f64) -> f64 {
    let begun_s = finger.time_s();
    let (mut ended_s, mut fastest) = (begun_s, 0.0_f64);
    while finger.time_s() < begun_s + seconds {
        if finger.time_s() >= begun_s + at_s {
            set_goal(finger, goal_n);
        }
        finger.step();
        let truth = finger.truth();
        if truth.force_n > 0.0 {
            ended_s = finger.time_s();
        } else if finger.time_s() > ended_s + 0.02 {
            fastest = fastest.max(truth.speed_mm_per_s.abs());
        }
    }
    fastest
}

/// Time from the first frame with torque to the touch of a finger of these tables, s.
fn touch_s(tables: &str, goal_n: f64) -> f64 {
    let mut finger = finger(tables);
    let begun_s = finger.time_s();
    set_goal(&mut finger, goal_n);
    touch(&mut finger);
    finger.time_s() - begun_s
}

/// A value of one case and the largest one allowed.
struct Case {
    what: String,
    is: f64,
    most: f64,
}

impl Case {
    fn new(what: String, is: f64, most: f64) -> Self {
        Self { what, is, most }
    }

    /// A case in which something must not be.
    fn never(what: String, is: bool) -> Self {
        Self::new(what, f64::from(u8::from(is)), 0.0)
    }
}

/// Does the work for each pair, on all cores.
fn each<A: Copy + Sync, B: Copy + Sync, R: Send>(
    firsts: &[A],
    seconds: &[B],
    work: impl Fn(A, B) -> R + Sync,
) -> Vec<R> {
    let pairs = firsts.iter().flat_map(|first| seconds.iter().map(move |second| (first, second)));
    cores::map(pairs, |(first, second)| work(*first, *second))
}

/// Prints the case nearest to its bound or farthest beyond it, and fails if any case is beyond its bound.
fn judge(name: &str, unit: &str, cases: &[Case]) {
    let worst = cases.iter().max_by(|a, b| (a.is - a.most).total_cmp(&(b.is - b.most))).expect("there are cases");
    let beyond: Vec<String> = cases
        .iter()
        .filter(|case| case.is.is_nan() || case.is > case.most)
        .map(|case| format!("{}: {:.3} {unit}, {:.3} allowed", case.what, case.is, case.most))
        .collect();
    let Case { what, is, most } = worst;
    println!("{name}: {} of {} beyond; worst {is:.3} {unit}, {most:.3} allowed: {what}", beyond.len(), cases.len());
    assert!(beyond.is_empty(), "{name}: these cases are beyond their bounds: {beyond:#?}");
}

fn log_uniform(rng: &mut Rng, least: f64, most: f64) -> f64 {
    least * (most / least).powf(rng.f64())
}

fn uniform(rng: &mut Rng, least: f64, most: f64) -> f64 {
    least + (most - least) * rng.f64()
}

/// A text in which each first part is replaced by the second one.
fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}
