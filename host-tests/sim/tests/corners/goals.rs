//! A goal of 0 releases the object, whatever was requested just before.

use crate::{
    CONTACT_ON_N, Case, Finger, LOSSES, fault, finger, interrupt_torque, judge, log_uniform, mode, object, press,
    uniform,
};
use fastrand::Rng;
use fingertip::measure::Task;
use fingertip::state::Mode;
use sim::cores;

/// Time within which a goal of 0 releases an object of this compliance. In a very soft object the tip has several times
/// the distance to go.
fn release_s(yield_mm_per_n: f64) -> f64 {
    if yield_mm_per_n > 1.0 { 0.8 } else { 0.5 }
}

/// Requests a release; returns the largest force from the time allowed to 1.5 s after, N.
fn left_n(finger: &mut Finger, yield_mm_per_n: f64) -> f64 {
    press(finger, 0.0, release_s(yield_mm_per_n));
    finger.run(1.5)
}

fn case(finger: &mut Finger, yield_mm_per_n: f64, what: String) -> Case {
    Case::new(what, left_n(finger, yield_mm_per_n), CONTACT_ON_N)
}

/// Holds a goal until 1 s, then 0 for `first_s`, `again_n` for `second_s`, and 0 for good.
fn two_changes(tables: &str, yield_mm_per_n: f64, goals_n: [f64; 2], times_s: [f64; 2]) -> Case {
    let mut finger = finger(tables);
    press(&mut finger, goals_n[0], 1.0);
    press(&mut finger, 0.0, times_s[0]);
    press(&mut finger, goals_n[1], times_s[1]);
    let what = format!(
        "{yield_mm_per_n:.3} mm/N, goals {goals_n:.2?} N, 0 for {:.4} s, again for {:.4} s",
        times_s[0], times_s[1]
    );
    case(&mut finger, yield_mm_per_n, what)
}

#[test]
fn goal_zero_releases_after_two_quick_changes() {
    let mut cases = Vec::new();
    for losses in ["", LOSSES] {
        for (yield_mm_per_n, goal_n) in [(0.7, 5.0), (1.0, 7.0)] {
            let tables = object(2.5, yield_mm_per_n) + losses;
            cases.push(two_changes(&tables, yield_mm_per_n, [goal_n, 0.5], [0.003, 0.003]));
        }
    }
    judge("goal 0 after two changes", "N", &cases);
}

#[test]
fn goal_zero_releases_after_torque_was_off_for_10_ms() {
    let mut cases = Vec::new();
    for losses in ["", LOSSES] {
        for (yield_mm_per_n, goal_n) in [(0.7, 5.0), (2.0, 7.0)] {
            for wait_s in [0.0, 0.01, 0.3] {
                let mut finger = finger(&(object(2.5, yield_mm_per_n) + losses));
                press(&mut finger, goal_n, 1.0);
                interrupt_torque(&mut finger, 0.01);
                finger.run(wait_s);
                let what = format!("{yield_mm_per_n} mm/N, {goal_n} N, goal 0 {wait_s} s after torque on {losses:?}");
                cases.push(case(&mut finger, yield_mm_per_n, what));
            }
        }
    }
    judge("goal 0 after torque off for 10 ms", "N", &cases);
}

/// A soft object, its goal and the losses of the drive, drawn.
fn drawn(rng: &mut Rng) -> (f64, f64, String) {
    let (yield_mm_per_n, goal_n) = (log_uniform(rng, 0.1, 2.0), uniform(rng, 0.3, 7.0));
    (yield_mm_per_n, goal_n, object(2.5, yield_mm_per_n) + if rng.bool() { LOSSES } else { "" })
}

#[test]
fn goal_zero_releases_soft_objects_after_a_torque_interruption() {
    let cases = cores::map(0..56, |seed| {
        let mut rng = Rng::with_seed(seed);
        let (yield_mm_per_n, goal_n, tables) = drawn(&mut rng);
        let (off_s, wait_s) = (uniform(&mut rng, 0.002, 0.06), uniform(&mut rng, 0.0, 0.1));
        let mut finger = finger(&tables);
        press(&mut finger, goal_n, 1.0);
        interrupt_torque(&mut finger, off_s);
        finger.run(wait_s);
        let what =
            format!("{seed}: {yield_mm_per_n:.3} mm/N, {goal_n:.2} N, off for {off_s:.4} s, 0 after {wait_s:.3} s");
        case(&mut finger, yield_mm_per_n, what)
    });
    judge("soft objects, torque interrupted", "N", &cases);
}

#[test]
fn goal_zero_releases_soft_objects_after_a_goal_interruption() {
    let cases = cores::map(0..35, |seed| {
        let mut rng = Rng::with_seed(100 + seed);
        let (yield_mm_per_n, goal_n, tables) = drawn(&mut rng);
        let again_n = uniform(&mut rng, 0.1, 1.0) * goal_n;
        let times_s = [0; 2].map(|_| log_uniform(&mut rng, 0.001, 0.03));
        two_changes(&tables, yield_mm_per_n, [goal_n, again_n], times_s)
    });
    judge("soft objects, goal interrupted", "N", &cases);
}

/// The surface of a soft object is where the tip touched it, not where it has yielded to.
#[test]
fn goal_zero_releases_a_soft_object_after_a_press_that_measures() {
    let cases = cores::map([0.0, 0.3, 0.5, 1.0, 2.0], |yield_mm_per_n| {
        let mut finger = finger(&(object(3.0, yield_mm_per_n) + LOSSES));
        finger.run(0.1);
        finger.request(Task::Press);
        finger.step();
        let until_s = finger.time_s() + 12.0;
        while mode(&finger) == Mode::Press && finger.time_s() < until_s {
            finger.step();
        }
        let what = format!("{yield_mm_per_n} mm/N, then {:?} {:?}", mode(&finger), fault(&finger));
        case(&mut finger, yield_mm_per_n, what)
    });
    judge("soft objects, after a press that measures", "N", &cases);
}

#[test]
fn goal_zero_releases_a_soft_object_that_moved_while_it_was_held() {
    let mut tasks = Vec::new();
    for yield_mm_per_n in [0.3, 0.7, 1.0, 2.0] {
        tasks.extend([-2.0, -1.0, 1.0, 2.0].map(|by_mm| (yield_mm_per_n, by_mm)));
    }
    let cases = cores::map(tasks, |(yield_mm_per_n, by_mm)| {
        let mut finger = finger(&(object(5.0, yield_mm_per_n) + LOSSES));
        press(&mut finger, 3.0, 1.0);
        finger.carry_object(5.0, 5.0 + by_mm, 40.0, |_| {});
        finger.run(0.3);
        let what = format!("{yield_mm_per_n} mm/N, moved by {by_mm} mm, {:?}", fault(&finger));
        case(&mut finger, yield_mm_per_n, what)
    });
    judge("soft objects that moved", "N", &cases);
}
