//! An object that comes to a released tip, moved by another finger for example: the baseline does not learn it, so the
//! next press does not press harder by it.

use fingertip::config::newtons;
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
