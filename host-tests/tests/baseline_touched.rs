//! An object that comes to a released tip, moved by another finger for example: the baseline does not learn it, so the
//! next press does not press harder by it.

use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::shipped::Config;
use host_tests::finger::config;
use sim::native::bench::Bench;
use sim::setup::Setup;

/// A press of 1 N, released; some time after that the object comes to the tip, this deep, for 5 s; then it is gone, and
/// the next press has 1 N for its goal. The array's reading at the end of the touch, the true force, and the largest
/// force of that press.
fn next_press(torque: bool, after_s: f64, depth_mm: f64) -> [f64; 3] {
    let setup = Setup::default();
    let mut board: Bench = Bench::of(&setup, &config());
    board.tare();
    board.command().goal = newtons(1_000);
    board.run(1.0);
    board.command().goal = newtons(0);
    board.run(after_s);
    board.command().torque = torque;
    let travel = board.truth().travel_mm;
    board.carry_object(setup.wall.distance_mm, travel - depth_mm, 100.0, |_| {});
    board.run(5.0);
    let touch = [board.status().contact.force.0.to_num(), board.truth().force_n];
    board.place_object(setup.wall.distance_mm);
    board.run(0.01);
    (board.command().torque, board.command().goal) = (true, newtons(1_000));
    let [read, held] = touch;
    [read, held, board.run(2.0)]
}

/// With torque the tip backs off from it; without, the object keeps pressing.
#[test]
fn what_comes_to_a_released_tip_is_not_learnt() {
    let cases = [(0.5, 0.3), (0.5, 0.6), (0.5, 1.0), (2.0, 0.3), (2.0, 1.0), (0.05, 1.0)];
    // At once after the contact, when a residue is learnt.
    let soon = [(0.05, 0.3), (0.05, 0.5), (0.05, 0.6), (0.05, 0.8)];
    let all = [
        cases.map(|case| (false, case)).to_vec(),
        cases.map(|case| (true, case)).to_vec(),
        soon.map(|case| (true, case)).to_vec(),
    ];
    for (torque, (after_s, depth_mm)) in all.concat() {
        let [read, held, largest] = next_press(torque, after_s, depth_mm);
        let name = format!("torque {torque}, {depth_mm} mm deep after {after_s} s: {read} of {held} N, then {largest}");
        assert!(if torque { held == 0.0 } else { held > 0.05 }, "{name}");
        assert!((read - held).abs() < 0.01 + 0.01 * held, "{name}");
        assert!(largest < 1.02, "{name}");
    }
}

/// Less than the force of a contact is taken for a residue.
#[test]
fn no_more_than_the_force_of_a_contact_is_learnt() {
    let [read, held, largest] = next_press(true, 0.05, 0.2);
    assert!(read < 0.01 && held > 0.02 && largest < 1.06, "{read} of {held} N, then {largest}");
}

fn bench(params: &Params) -> Bench {
    let mut board = Bench::of(&Setup::default(), &Config::shipped(params).unwrap());
    board.tare();
    board
}

/// Torque off, a characteristic that is a line again, the object gone for so long, then a press.
fn after_a_curve(touching: bool, off_s: f64, goal_mn: i32) -> f64 {
    let mut board = bench(&Params { curve_permille: 500, ..Params::DEFAULT });
    if touching {
        board.command().goal = newtons(1_000);
        board.run(0.5);
    }
    board.command().torque = false;
    board.command().goal = newtons(0);
    board.run(0.01);
    board.pipeline().configure(&config());
    board.place_object(50.0);
    board.place(0.0);
    board.run(off_s);
    board.place_object(5.0);
    board.command().torque = true;
    board.command().goal = newtons(goal_mn);
    board.run(2.0)
}

/// `curve_permille` to 0 while the tip touches: the baseline learns the last bent frame's row for ever.
#[test]
fn a_characteristic_that_is_none_any_more_leaves_nothing() {
    let mut failed = Vec::new();
    for (off_s, goal_mn) in [(0.1, 1_000), (0.3, 1_000), (0.5, 1_000), (0.6, 7_000), (2.0, 1_000)] {
        let largest = after_a_curve(true, off_s, goal_mn);
        if largest > 1.02e-3 * f64::from(goal_mn) {
            failed.push(format!("off for {off_s} s, goal {goal_mn} mN: {largest:.3} N"));
        }
    }
    // Nothing touched, only noise of +-3 codes: what one frame's noise was is added up.
    for seed in 0..3 {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut board = bench(&Params { curve_permille: 500, ..Params::DEFAULT });
        board.command().torque = false;
        let mut noisy = |board: &mut Bench, frames: u32| {
            for _ in 0..frames {
                board.step_with(|record| {
                    for (row, column) in (0..10).flat_map(|row| (0..10).map(move |column| (row, column))) {
                        let code = i32::from(record.frame.code(row, column)) + rng.i32(-3..=3);
                        record.frame.set_code(row, column, code as u16);
                    }
                });
            }
        };
        noisy(&mut board, 200);
        board.pipeline().configure(&config());
        noisy(&mut board, 200_000);
        let picture = *board.pipeline().array().picture();
        // 5.86 uN a sixteenth of a code.
        let off_n = f64::from(picture.sum) * 5.86e-6;
        if off_n.abs() > 0.015 {
            failed.push(format!(
                "noise {seed}: {off_n:.3} N after 20 s, and the highest taxel {} codes",
                picture.peak / 16
            ));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// The object is put against the released tip as soon as that is clear of it, and follows.
fn clear(board: &mut Bench, clear_mm: f64) {
    while board.truth().travel_mm > clear_mm {
        board.step();
    }
}

/// `docs/safety.md`, Releasing: a reading that rises above the minimum since the release is a new touch. Something
/// presses a released tip by more than a quarter of what was held, for 5 s; then by less.
#[test]
fn what_presses_for_seconds_is_not_left_of_what_was_held() {
    let mut failed = Vec::new();
    for (goal_mn, first_mm, then_mm) in [(2_000, 0.95, 0.75), (6_000, 1.6, 1.3)] {
        let mut board = bench(&Params::DEFAULT);
        board.command().goal = newtons(goal_mn);
        board.run(1.0);
        board.command().goal = newtons(0);
        clear(&mut board, 4.1);
        let travel = board.truth().travel_mm;
        board.place_object(travel - first_mm);
        board.run(5.0);
        board.place_object(4.0 - then_mm);
        board.run(3.0);
        let (held, read) = (board.truth().force_n, board.status().contact.force.0.to_num::<f64>());
        board.place_object(5.0);
        board.run(0.05);
        board.command().goal = newtons(1_000);
        let largest = board.run(1.0);
        if (held - read).abs() > 0.02 || largest > 1.02 {
            failed.push(format!("after {goal_mn} mN: {held:.3} N read {read:.3} N; goal 1 N then has {largest:.3} N"));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// What was held before a tare, with torque off and 5 s in between, is nothing that a later touch leaves a quarter of.
#[test]
fn a_tare_forgets_what_was_held() {
    let mut largest = [0.0; 2];
    for (history, largest) in [false, true].into_iter().zip(&mut largest) {
        let mut board = bench(&Params::DEFAULT);
        if history {
            board.command().goal = newtons(6_000);
            board.run(1.0);
            board.command().torque = false;
            board.command().goal = newtons(0);
            board.run(0.2);
            board.place_object(50.0);
            board.place(0.0);
            board.run(5.0);
            board.place_object(5.0);
            board.tare();
        }
        board.command().goal = newtons(200);
        board.run(1.0);
        board.command().goal = newtons(0);
        clear(&mut board, 4.2);
        board.place_object(3.0);
        board.run(3.0);
        board.place_object(5.0);
        board.run(0.05);
        board.command().goal = newtons(1_000);
        *largest = board.run(1.0);
    }
    assert!(largest[1] < largest[0] + 0.02, "goal 1 N has {largest:?} N without and with a history");
}
