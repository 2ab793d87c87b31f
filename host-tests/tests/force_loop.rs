//! The loop natively: touch, steps, release. The same bounds hold for the flash image on the virtual board.

use fingertip::config::newtons;
use fingertip::pipeline::Status;
use fingertip::state::{Limits, Mode};
use sim::native::bench::Bench;
use sim::setup::Setup;

fn board() -> Bench {
    let mut board = Bench::default();
    board.tare();
    board
}

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
fn first_touch_from_five_millimetres_does_not_overshoot() {
    let mut board = board();
    let (trace, status) = run(&mut board, 1_000, 0.5);
    let peak = trace.iter().map(|(_, force)| *force).fold(0.0, f64::max);
    assert!((0.995..=1.10).contains(&peak), "peak {peak} N");
    assert_eq!((status.mode, status.fault), (Mode::Force, None));
    let touched_s = trace.iter().find(|(_, force)| *force > 0.0).expect("touches").0;
    // 5 mm at 30 mm/s.
    assert!((0.160..=0.180).contains(&touched_s), "touched after {touched_s} s");
}

#[test]
fn force_steps_are_quick_and_true() {
    let mut board = board();
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

#[test]
fn a_zero_goal_lets_go_and_stands_clear() {
    let mut board = board();
    run(&mut board, 2_000, 0.5);
    let (trace, status) = run(&mut board, 0, 0.5);
    assert_eq!((status.mode, status.fault), (Mode::Release, None));
    assert_eq!(trace.last().unwrap().1, 0.0);
    let clear_mm = Setup::default().wall.distance_mm - board.truth().travel_mm;
    assert!((0.8..=1.3).contains(&clear_mm), "stands {clear_mm} mm clear");
    let before_mm = board.truth().travel_mm;
    run(&mut board, 0, 0.2);
    assert!((board.truth().travel_mm - before_mm).abs() < 0.01);
}

#[test]
fn a_goal_beyond_the_limit_is_cut_and_said() {
    let mut board = board();
    let (trace, status) = run(&mut board, 8_500, 0.6);
    let last = trace.last().unwrap().1;
    assert!((6.9..=7.1).contains(&last), "{last} N");
    assert!(status.limits.has(Limits::GOAL));
}

#[test]
fn an_object_that_goes_away_is_not_chased() {
    let mut board = board();
    run(&mut board, 2_000, 0.5);
    board.place_object(15.0);
    let (_, status) = run(&mut board, 2_000, 0.05);
    assert_eq!(status.mode, Mode::Approach);
    let speed = board.truth().speed_mm_per_s;
    assert!((25.0..=35.0).contains(&speed), "{speed} mm/s");
    let (_, status) = run(&mut board, 2_000, 0.6);
    assert_eq!(status.mode, Mode::Force);
    assert!((board.truth().force_n - 2.0).abs() < 0.015);
}

#[test]
fn the_end_of_the_travel_stops_an_approach() {
    let mut board = board();
    board.place_object(40.0);
    let (_, status) = run(&mut board, 1_000, 1.0);
    assert!(status.limits.has(Limits::TRAVEL));
    assert!((19.5..=20.5).contains(&board.truth().travel_mm), "{} mm", board.truth().travel_mm);
    assert!(board.truth().speed_mm_per_s.abs() < 1.0);
}

#[test]
fn torque_off_lets_the_motor_coast() {
    let mut board = board();
    run(&mut board, 2_000, 0.5);
    board.command().torque = false;
    let status = board.step();
    assert_eq!((status.mode, status.duty.0), (Mode::Off, 0));
}

#[test]
fn the_same_run_twice_gives_the_same_bits() {
    let trace = || {
        let mut board = board();
        let (trace, _) = run(&mut board, 3_000, 0.4);
        trace.into_iter().map(|(_, force)| force.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(trace(), trace());
}

#[test]
fn a_goal_below_the_least_contact_is_held_as_that() {
    for goal_mn in [1, 5, 14, 15, 39] {
        let mut board = board();
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
    let mut board = board();
    let (_, status) = run(&mut board, 40, 0.5);
    assert!(!status.limits.has(Limits::GOAL), "the least is none that is moved");
}
