//! A goal of 0 releases the object, whatever happened before.

use crate::common::*;
use sim::effects::{Named, Set};
use sim::scene::read;

/// Speed of an object that is carried.
const CARRIED_MM_PER_S: f64 = 5.0;

fn bench() -> Bench {
    let mut board = Bench::of(&Setup::default(), &config());
    board.tare();
    board
}

/// An ordinary finger: noise, friction, hysteresis, creep, uneven gains.
fn ordinary(seed: u64) -> Bench<Named> {
    let text = format!(
        "about = \"a finger\"\nseed = {seed}\nduration_s = 1.0\n[object]\ndistance_mm = 5.0\ncentre_x_mm = 1.0\n\
        [effects.noise]\nrms_codes = 1.5\n[effects.dry_friction]\ntorque_mnm = 0.15\n[effects.hysteresis]\nwidth_percent = 4\n\
        [effects.creep]\nrate_percent_per_decade = 2\n[effects.gain_spread]\nrms_percent = 6\n\
        [[script]]\nat_s = 0.0\ngoal_n = 0.0\n"
    );
    let mut board = Bench::new(&read("t.toml", &text, &[]).unwrap_or_else(|error| panic!("{error}"))).unwrap();
    board.tare();
    board
}

fn told<E: Set>(board: &mut Bench<E>) -> String {
    let (truth, status) = (board.truth(), *board.status());
    format!(
        "{:?} {:?}, true {:.3} N, read {:.3} N, at {:.3} mm, limits {:014b}",
        status.mode,
        status.fault,
        truth.force_n,
        status.contact.force.0.to_num::<f64>(),
        truth.travel_mm,
        status.limits.0
    )
}

/// Requests a release, and returns the force that is still held after the given time, s.
fn kept<E: Set>(board: &mut Bench<E>, seconds: f64) -> Option<String> {
    board.command().goal = newtons(0);
    board.run(seconds);
    (board.truth().force_n > 0.0).then(|| told(board))
}

fn moved_while_held<E: Set>(board: &mut Bench<E>, goal_mn: i32, moved_mm: f64) -> Option<String> {
    board.command().goal = newtons(goal_mn);
    board.run(0.7);
    board.carry_object(5.0, 5.0 - moved_mm, CARRIED_MM_PER_S, |_| {});
    board.run(0.3);
    let held = board.truth().force_n;
    kept(board, 2.0).map(|told| format!("goal {goal_mn} mN, {moved_mm} mm: held {held:.3} N, then let go: {told}"))
}

/// Another finger pushes a held object towards this one: the loop follows and holds the force, but the stored surface
/// stays at the travel of the first touch. A release to that surface once left the object in contact.
#[test]
fn an_object_that_came_along_while_it_was_held_is_let_go() {
    let mut failed = Vec::new();
    for goal_mn in [300, 1_000, 3_000] {
        for moved_mm in [1.0, 1.5, 2.0, 2.5] {
            failed.extend(moved_while_held(&mut bench(), goal_mn, moved_mm));
        }
    }
    for seed in 0..6 {
        for goal_mn in [1_000, 3_000] {
            failed.extend(
                moved_while_held(&mut ordinary(seed), goal_mn, 2.5).map(|text| format!("ordinary {seed}: {text}")),
            );
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

fn goal_0_during_a_press<E: Set>(board: &mut Bench<E>) -> Option<String> {
    board.command().goal = newtons(1_000);
    board.step();
    board.request(Task::Press);
    board.run(0.05);
    kept(board, 16.0)
}

/// A press requested during the first approach; the host takes the goal back while it presses.
#[test]
fn a_press_that_measures_is_let_go() {
    let mut failed = Vec::new();
    failed.extend(goal_0_during_a_press(&mut bench()));
    for seed in 0..4 {
        failed.extend(goal_0_during_a_press(&mut ordinary(seed)).map(|text| format!("ordinary {seed}: {text}")));
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// The sequence of `docs/commissioning.md`: tare, torque, goal 0, a press. The tip rests at the clearance behind the
/// surface that the press touched, not where the guard cuts the motor off.
#[test]
fn a_press_from_a_released_tip_ends_at_the_clearance() {
    let mut failed = Vec::new();
    let mut board = bench();
    board.step();
    board.request(Task::Press);
    board.run(12.0);
    assert_eq!(board.status().measure.state, MeasureState::Done);
    let behind_mm = 5.0 - board.truth().travel_mm;
    if !(0.75..1.25).contains(&behind_mm) {
        failed.push(format!("{behind_mm:.3} mm behind, {}", told(&mut board)));
    }
    // The press touches a nearer surface than the touch before.
    let mut board = bench();
    board.place_object(10.0);
    board.command().goal = newtons(1_000);
    board.run(1.0);
    board.command().goal = newtons(0);
    board.run(0.7);
    board.carry_object(10.0, 7.5, CARRIED_MM_PER_S, |_| {});
    board.request(Task::Press);
    board.run(16.0);
    if board.truth().force_n > 0.0 {
        failed.push(format!("nearer: {}", told(&mut board)));
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// A residue of an earlier contact is not released like an object. Here parameters are written with torque off, so the
/// touch is forgotten, and the object is taken away.
#[test]
fn a_residue_from_before_torque_does_not_make_the_tip_go_back() {
    let mut failed = Vec::new();
    for seed in 0..4 {
        let mut board = ordinary(seed);
        board.command().goal = newtons(6_000);
        board.run(3.0);
        board.command().torque = false;
        board.command().goal = newtons(0);
        board.run(0.3);
        let config = board.pipeline().config().clone();
        board.pipeline().configure(&config);
        board.carry_object(5.0, 15.0, CARRIED_MM_PER_S, |_| {});
        let before_mm = board.truth().travel_mm;
        let residue_n: f64 = board.status().contact.force.0.to_num();
        board.command().torque = true;
        board.run(1.0);
        let back_mm = before_mm - board.truth().travel_mm;
        // The clearance, half a millimetre to see that the force does not fall, and the residue's indentation.
        if !(-0.1..2.2).contains(&back_mm) {
            failed.push(format!("{seed}: a residue of {residue_n:.3} N, {back_mm:.3} mm back: {}", told(&mut board)));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// An object is moved to a released tip, is held, and is released again.
#[test]
fn what_came_to_a_released_tip_is_held_and_let_go() {
    let mut failed = Vec::new();
    for (to_mm, goal_mn) in [(3.0, 1_000), (2.5, 1_000), (2.0, 1_000), (1.5, 200), (0.8, 200)] {
        let mut board = bench();
        board.command().goal = newtons(1_000);
        board.run(0.7);
        board.command().goal = newtons(0);
        board.run(0.7);
        board.carry_object(5.0, to_mm, CARRIED_MM_PER_S, |_| {});
        board.run(0.3);
        board.command().goal = newtons(goal_mn);
        board.run(1.0);
        let held = board.truth().force_n;
        if (held - f64::from(goal_mn) * 1e-3).abs() > 0.05 || board.status().mode != Mode::Force {
            failed.push(format!("to {to_mm} mm, goal {goal_mn} mN: {}", told(&mut board)));
        }
        failed.extend(kept(&mut board, 2.0).map(|told| format!("to {to_mm} mm, let go of {goal_mn} mN: {told}")));
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Torque off and on again does not move the zero of the travel, so the finger goes no farther than without it.
#[test]
fn torque_off_does_not_extend_the_travel() {
    let mut board = bench();
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
