//! The loop natively: touch, steps, release. The same bounds hold for the flash image on the virtual board.

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
fn first_touch_from_five_millimetres_does_not_overshoot() {
    let mut board = ready();
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

#[test]
fn a_zero_goal_lets_go_and_stands_clear() {
    let mut board = ready();
    run(&mut board, 2_000, 0.5);
    let (trace, status) = run(&mut board, 0, 0.5);
    assert_eq!((status.mode, status.fault), (Mode::Release, None));
    assert_eq!(trace.last().unwrap().1, 0.0);
    let clear_mm = Setup::default().wall.distance_mm - board.truth().travel_mm;
    assert!((0.8..=1.3).contains(&clear_mm), "{clear_mm} mm clear");
    let before_mm = board.truth().travel_mm;
    run(&mut board, 0, 0.2);
    assert!((board.truth().travel_mm - before_mm).abs() < 0.01);
}

#[test]
fn a_goal_beyond_the_limit_is_cut_and_said() {
    let mut board = ready();
    let (trace, status) = run(&mut board, 8_500, 0.6);
    let last = trace.last().unwrap().1;
    assert!((6.9..=7.1).contains(&last), "{last} N");
    assert!(status.limits.has(Limits::GOAL));
}

#[test]
fn an_object_that_goes_away_is_not_chased() {
    let mut board = ready();
    run(&mut board, 2_000, 0.5);
    // 10 mm away, at half a metre in a second.
    board.carry_object(5.0, 15.0, 500.0, |_| {});
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
    let mut board = ready();
    board.place_object(40.0);
    let (_, status) = run(&mut board, 1_000, 1.0);
    assert!(status.limits.has(Limits::TRAVEL));
    assert!((19.5..=20.5).contains(&board.truth().travel_mm), "{} mm", board.truth().travel_mm);
    assert!(board.truth().speed_mm_per_s.abs() < 1.0);
}

/// The reading vanishes within a frame while the tip rests: it is the array's, so the finger does not press
/// harder. After 3 ms without a force the finger releases the object, and seeks it then.
#[test]
fn a_reading_that_vanishes_at_once_does_not_make_it_press_harder() {
    for goal_mn in [200, 1_000, 5_000] {
        let mut board = ready();
        run(&mut board, goal_mn, 0.5);
        let mut free = Bench::default();
        free.step();
        let blank = free.frame().codes;
        let (mut largest_n, mut modes) = (0.0_f64, Vec::new());
        for _ in 0..20_000 {
            let mode = board.step_with(|record| record.frame.codes = blank).mode;
            largest_n = largest_n.max(board.truth().force_n);
            modes.push(mode);
            if mode == Mode::Approach {
                break;
            }
        }
        assert!(largest_n < 1.02e-3 * f64::from(goal_mn) + 0.005, "{goal_mn} mN: {largest_n} N");
        modes.dedup();
        assert_eq!(modes, [Mode::Force, Mode::Release, Mode::Approach], "{goal_mn} mN");
        assert_eq!((board.truth().force_n, board.status().fault), (0.0, None), "{goal_mn} mN");
    }
}

/// A motor that is shorted at any moment of a step stops below 1.3 times the goal and 0.4 N.
#[test]
fn a_motor_that_is_shorted_on_the_way_stops_within_its_bound() {
    for (from_mn, goal_mn) in [(0, 100), (0, 1_000), (0, 7_000), (100, 500), (200, 2_000), (200, 7_000), (2_000, 5_000)]
    {
        for stopped_after in (1..40).map(|step| 5 * step) {
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
fn a_goal_below_the_least_contact_is_held_as_that() {
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
}

/// An object that yields at 100 mm/s: the force falls by more than a quarter within a frame of a slow scan.
#[test]
fn a_slow_scan_follows_an_object_that_yields() {
    let config = allowed(Params { settle_ns: 100_000, sample_cycles: 480, ..images::CONFIRMED });
    let frame_s = f64::from(config.timing.frame_ns) * 1e-9;
    let mut board = Bench::of(&Setup::default(), &config);
    board.tare();
    run(&mut board, 1_000, 1.0);
    for frame in 1..=3 {
        board.place_object(5.0 + 100.0 * frame_s * f64::from(frame));
        board.step();
    }
    let (_, status) = run(&mut board, 1_000, 2.0);
    let force_n = board.truth().force_n;
    assert!(status.mode == Mode::Force && (force_n - 1.0).abs() < 0.02, "{force_n} N, {:?}", status.mode);
}
