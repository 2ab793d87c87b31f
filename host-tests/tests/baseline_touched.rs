//! Something that comes to a tip which has let go, as an object that another finger moves along: the baseline does not
//! learn it, so the next press does not press harder by it.

use fingertip::config::newtons;
use host_tests::finger::config;
use sim::native::bench::Bench;
use sim::setup::Setup;

/// A press of 1 N, let go; so long after that the object comes to the tip, this deep, for 5 s; then it is gone, and the
/// next press has 1 N for its goal. What the array reads in the end of the touch, what is true, and the largest force
/// of that press.
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
    board.place_object(travel - depth_mm);
    board.run(5.0);
    let touch = [board.status().contact.force.0.to_num(), board.truth().force_n];
    board.place_object(setup.wall.distance_mm);
    board.run(0.01);
    (board.command().torque, board.command().goal) = (true, newtons(1_000));
    let [read, held] = touch;
    [read, held, board.run(2.0)]
}

#[test]
fn what_comes_to_a_released_tip_is_not_learnt() {
    for torque in [false, true] {
        for (after_s, depth_mm) in [(0.5, 0.3), (0.5, 0.6), (0.5, 1.0), (2.0, 0.3), (2.0, 1.0), (0.05, 1.0)] {
            let [read, held, largest] = next_press(torque, after_s, depth_mm);
            let name =
                format!("torque {torque}, {depth_mm} mm deep after {after_s} s: {read} of {held} N, then {largest}");
            assert!(held > 0.05 && (read - held).abs() < 0.01 + 0.01 * held, "{name}");
            assert!(largest < 1.02, "{name}");
        }
    }
}

#[test]
fn at_once_after_a_contact_no_more_than_a_quarter_of_it_is_taken_for_what_is_left() {
    for (depth_mm, learnt) in [(0.3, true), (0.5, true), (0.6, false), (0.8, false)] {
        let [read, held, largest] = next_press(true, 0.05, depth_mm);
        let name = format!("{depth_mm} mm deep: {read} of {held} N, then {largest}");
        assert_eq!(read < 0.05, learnt, "{name}");
        assert!(largest < 1.27, "{name}");
    }
}
