//! The loop natively: steps, limits, release. The same bounds hold for the flash image on the virtual board.

use crate::common::*;

/// True force after each frame of a stretch of time.
fn run(board: &mut Bench, goal_mn: i32, seconds: f64) -> (Vec<(f64, f64)>, Status) {
    board.command().goal = newtons(goal_mn);
    let start_s = board.time_s();
    let mut trace = Vec::new();
    let mut status = board.step();
    while board.time_s() - start_s < seconds {
        trace.push((board.time_s() - start_s, board.truth().force_n));
        status = board.step();
    }
    (trace, status)
}

fn time_at_share(trace: &[(f64, f64)], from: f64, to: f64, share: f64) -> f64 {
    trace.iter().find(|(_, force)| (force - from) / (to - from) >= share).expect("the step arrives").0
}

#[test]
fn force_steps_are_quick_and_true() {
    let mut board = ready();
    run(&mut board, 200, 0.5);
    for (from_mn, to_mn) in [(200, 2_000), (2_000, 5_000), (5_000, 1_000), (1_000, 200), (200, 7_000), (7_000, 50)] {
        let from = f64::from(from_mn) / 1e3;
        let to = f64::from(to_mn) / 1e3;
        let (trace, status) = run(&mut board, to_mn, 0.15);
        let name = format!("{from} -> {to} N");
        assert_eq!((status.mode, status.fault), (Mode::Force, None), "{name}");

        let rise_s = time_at_share(&trace, from, to, 0.9) - time_at_share(&trace, from, to, 0.1);
        assert!((0.002..=0.020).contains(&rise_s), "{name}: rise {rise_s} s");
        let overshoot = trace.iter().map(|(_, force)| (force - to) / (to - from)).fold(0.0, f64::max);
        assert!(overshoot <= 0.02, "{name}: overshoot {overshoot}");
        let settled_s = trace.iter().rev().find(|(_, force)| (force - to).abs() > 0.02 * to).map_or(0.0, |(t, _)| *t);
        assert!(settled_s <= 0.040, "{name}: settled after {settled_s} s");
        let steady: Vec<f64> = trace.iter().filter(|(t, _)| *t > 0.1).map(|(_, force)| force - to).collect();
        let worst = steady.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        assert!(worst <= 0.005 * to + 0.005, "{name}: steady error {worst} N");
    }
}

// A motor that is shorted at any moment of a step stops below 1.3 times the goal and 0.4 N.
sim::sizes!(a_motor_that_is_shorted_on_the_way_stops_within_its_bound, shorted_every(20), shorted_every(5));

fn shorted_every(frames: usize) {
    for (from_mn, goal_mn) in [(0, 100), (0, 1_000), (0, 7_000), (100, 500), (200, 2_000), (200, 7_000), (2_000, 5_000)]
    {
        for stopped_after in (5..200).step_by(frames) {
            let mut board = ready();
            let goal_n = f64::from(goal_mn) * 1e-3;
            if from_mn > 0 {
                run(&mut board, from_mn, 0.4);
            } else {
                // Counted from just before the touch.
                run(&mut board, goal_mn, 0.16);
            }
            board.command().goal = newtons(goal_mn);
            board.frames(stopped_after);
            board.pipeline().stop(Fault::LostFrames);
            let largest_n = board.run(0.1);
            let name = format!("{from_mn} to {goal_mn} mN, shorted after {stopped_after} frames");
            assert!(largest_n < 1.3 * goal_n + 0.4, "{name}: {largest_n} N");
        }
    }
}

#[test]
fn a_goal_is_held_within_the_least_contact_and_the_largest_force() {
    for goal_mn in [1, 5, 14, 15, 39] {
        let mut board = ready();
        let (_, status) = run(&mut board, goal_mn, 0.5);
        assert!(status.mode == Mode::Force && status.limits.has(Limits::GOAL), "{goal_mn} mN: {:?}", status.mode);
        let mut lost = 0;
        for _ in 0..3_000 {
            let status = board.step();
            lost += u32::from(status.mode != Mode::Force);
            let force_n = board.truth().force_n;
            assert!((0.030..=0.050).contains(&force_n), "{goal_mn} mN: {force_n} N");
        }
        assert_eq!(lost, 0, "{goal_mn} mN");
    }
    let mut board = ready();
    let (_, status) = run(&mut board, 40, 0.5);
    assert!(!status.limits.has(Limits::GOAL), "the smallest force needs no motion");
    let mut board = ready();
    let (_, status) = run(&mut board, 8_500, 0.6);
    let force_n = board.truth().force_n;
    assert!(status.limits.has(Limits::GOAL) && (6.9..=7.1).contains(&force_n), "{force_n} N");
}

/// Speed of an object that is carried.
const CARRIED_MM_PER_S: f64 = 5.0;

/// Requests a release, and expects no force after the given time, s.
fn lets_go(board: &mut Bench, seconds: f64, name: &str) {
    board.hold(0, seconds);
    assert!(board.truth().force_n <= 0.0, "{name}: {}", told(board));
}

fn moved_while_held(board: &mut Bench, goal_mn: i32, moved_mm: f64) {
    board.hold(goal_mn, 0.7);
    board.carry_object(5.0, 5.0 - moved_mm, CARRIED_MM_PER_S, |_| {});
    board.run(0.3);
    let held = board.truth().force_n;
    lets_go(board, 2.0, &format!("goal {goal_mn} mN, {moved_mm} mm, held {held:.3} N"));
}

// The loop follows a held object that is pushed towards it; a release to the surface of the first touch would hold it.
sim::sizes!(an_object_that_came_along_while_it_was_held_is_let_go, let_go_of_what_came_along: &[1_000], &[300, 3_000]);

fn let_go_of_what_came_along(goals_mn: &[i32]) {
    for &goal_mn in goals_mn {
        for moved_mm in [1.0, 1.5, 2.0, 2.5] {
            moved_while_held(&mut ready(), goal_mn, moved_mm);
        }
    }
    for seed in 0..6 {
        for &goal_mn in goals_mn.iter().filter(|goal_mn| **goal_mn >= 1_000) {
            moved_while_held(&mut ordinary(seed, 1.0, 4, 2), goal_mn, 2.5);
        }
    }
}

fn goal_0_during_a_press(board: &mut Bench) {
    board.command().goal = newtons(1_000);
    board.step();
    board.request(Task::Press);
    board.run(0.05);
    lets_go(board, 16.0, "a press");
}

/// A press requested during the first approach; the host takes the goal back while it presses.
#[test]
fn a_press_that_measures_is_let_go() {
    goal_0_during_a_press(&mut ready());
    goal_0_during_a_press(&mut ordinary(0, 1.0, 4, 2));
}

/// As in `docs/commissioning.md`: the tip rests at the clearance behind the surface that the press touched.
#[test]
fn a_press_from_a_released_tip_ends_at_the_clearance() {
    let mut board = ready();
    board.step();
    board.request(Task::Press);
    board.run(12.0);
    assert_eq!(board.status().measure.state, MeasureState::Done);
    let behind_mm = 5.0 - board.truth().travel_mm;
    assert!((0.75..1.25).contains(&behind_mm), "{behind_mm:.3} mm behind, {}", told(&mut board));
    // The press touches a nearer surface than the touch before.
    let mut board = ready();
    board.place_object(10.0);
    board.hold(1_000, 1.0);
    board.hold(0, 0.7);
    board.carry_object(10.0, 7.5, CARRIED_MM_PER_S, |_| {});
    board.request(Task::Press);
    board.run(16.0);
    assert!(board.truth().force_n <= 0.0, "nearer: {}", told(&mut board));
}

#[test]
fn what_came_to_a_released_tip_is_held_and_let_go() {
    for (to_mm, goal_mn) in [(3.0, 1_000), (2.5, 1_000), (2.0, 1_000), (1.5, 200), (0.8, 200)] {
        let mut board = ready();
        board.hold(1_000, 0.7);
        board.hold(0, 0.7);
        board.carry_object(5.0, to_mm, CARRIED_MM_PER_S, |_| {});
        board.run(0.3);
        board.hold(goal_mn, 1.0);
        let off = (board.truth().force_n - f64::from(goal_mn) * 1e-3).abs();
        let held = off <= 0.05 && board.status().mode == Mode::Force;
        assert!(held, "to {to_mm} mm, goal {goal_mn} mN: {}", told(&mut board));
        lets_go(&mut board, 2.0, &format!("to {to_mm} mm, {goal_mn} mN"));
    }
}
