//! A goal of 0 releases the object, whatever happened before.

use crate::common::*;

/// Speed of an object that is carried.
const CARRIED_MM_PER_S: f64 = 5.0;

/// Requests a release, and expects no force after the given time, s.
fn lets_go<E: Set>(board: &mut Bench<E>, seconds: f64, name: &str) {
    board.hold(0, seconds);
    assert!(board.truth().force_n <= 0.0, "{name}: {}", told(board));
}

fn moved_while_held<E: Set>(board: &mut Bench<E>, goal_mn: i32, moved_mm: f64) {
    board.hold(goal_mn, 0.7);
    board.carry_object(5.0, 5.0 - moved_mm, CARRIED_MM_PER_S, |_| {});
    board.run(0.3);
    let held = board.truth().force_n;
    lets_go(board, 2.0, &format!("goal {goal_mn} mN, {moved_mm} mm, held {held:.3} N"));
}

/// The loop follows a held object that is pushed towards it; a release to the surface of the first touch would hold it.
#[test]
fn an_object_that_came_along_while_it_was_held_is_let_go() {
    for goal_mn in [300, 1_000, 3_000] {
        for moved_mm in [1.0, 1.5, 2.0, 2.5] {
            moved_while_held(&mut ready(), goal_mn, moved_mm);
        }
    }
    for seed in 0..6 {
        for goal_mn in [1_000, 3_000] {
            moved_while_held(&mut ordinary(seed, 1.0, 4, 2), goal_mn, 2.5);
        }
    }
}

fn goal_0_during_a_press<E: Set>(board: &mut Bench<E>) {
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
    (0..4).for_each(|seed| goal_0_during_a_press(&mut ordinary(seed, 1.0, 4, 2)));
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

/// A residue of an earlier contact is not an object. Parameters that are written with torque off forget the touch.
#[test]
fn a_residue_from_before_torque_does_not_make_the_tip_go_back() {
    for seed in 0..4 {
        let mut board = ordinary(seed, 1.0, 4, 2);
        board.hold(6_000, 3.0);
        board.command().torque = false;
        board.hold(0, 0.3);
        let config = board.pipeline().config().clone();
        board.pipeline().configure(&config);
        board.carry_object(5.0, 15.0, CARRIED_MM_PER_S, |_| {});
        let before_mm = board.truth().travel_mm;
        let residue_n: f64 = board.status().contact.force.0.to_num();
        board.command().torque = true;
        board.run(1.0);
        let back_mm = before_mm - board.truth().travel_mm;
        // The clearance, half a millimetre to see that the force does not fall, and the residue's indentation.
        let name = format!("{seed}: a residue of {residue_n:.3} N, {back_mm:.3} mm back");
        assert!((-0.1..2.2).contains(&back_mm), "{name}: {}", told(&mut board));
    }
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

#[test]
fn torque_off_does_not_extend_the_travel() {
    let mut board = ready();
    board.place_object(100.0);
    board.command().goal = newtons(1_000);
    let most_mm = 20.0;
    for _ in 0..3 {
        board.run(1.0);
        let travel_mm = board.truth().travel_mm;
        assert!((most_mm - 1.0..most_mm + 1.0).contains(&travel_mm), "{travel_mm} mm: {}", told(&mut board));
        board.command().torque = false;
        board.run(0.1);
        board.command().torque = true;
    }
}
