//! Calibrations that outlive what they were made of.

use fingertip::calibrate::State;
use fingertip::config::newtons;
use fingertip::params::Params;
use fingertip::pressure::{Calibration, GAIN_ONE};
use fingertip::shipped::{COLUMNS, Config, ROWS, address};
use fingertip::state::Mode;
use sim::effects::set::Named;
use sim::native::bench::Bench;
use sim::scene::read;

#[path = "link/bench.rs"]
#[allow(dead_code, reason = "the link's tests take more of it")]
mod bus;

/// Accepted twice before the loop has the new parameters: each number is changed once.
#[test]
fn a_scale_is_accepted_once() {
    let mut board = bus::Bench::new();
    (board.status.scale.factor_ppm, board.status.scale.points) = (1_300_000, 2);
    board.write(address::SCALE, &[3]).expect("a write");
    let first = board.server.settings().record.params;
    assert_eq!((first.codes_per_kpa_milli, first.modulus_pa), (18_462, 325_000));
    // The same packet again, by a host that heard no answer, or by broadcast: the snapshot is still the one before.
    let again = board.write(address::SCALE, &[3]);
    let params = board.server.settings().record.params;
    assert!(params == first, "{again:?}: {} codes, {} Pa", params.codes_per_kpa_milli, params.modulus_pa);
}

/// Nor with other parameters than it was measured with.
#[test]
fn a_scale_is_accepted_with_the_parameters_that_it_was_measured_with() {
    let mut board = bus::Bench::new();
    (board.status.scale.factor_ppm, board.status.scale.points) = (1_300_000, 2);
    board.write_parameter("codes_per_kpa_milli", 12_000);
    assert!(board.write(address::SCALE, &[3]).is_err(), "{:?}", board.server.settings().record.params);
}

fn plate() -> Bench<Named> {
    let text = "about = \"a plate\"\nduration_s = 1.0\n[object]\ndistance_mm = 2.0\ncentre_x_mm = 0.5\ncentre_y_mm = 0.3\n\
        [effects.gain_spread]\nrms_percent = 8\n[[script]]\nat_s = 0.0\ngoal_n = 0.0\n";
    Bench::new(&read("t.toml", text, &[]).unwrap()).unwrap()
}

/// A second press is asked for, with torque on, while the first is worked out: it waits. Then torque goes off.
#[test]
fn a_press_that_waits_and_is_refused_leaves_the_one_before() {
    let mut failed = Vec::new();
    for wait in [10, 1_500, 2_985, 3_010, 3_040] {
        let mut board = plate();
        // The gains in force are not 1.
        board.pipeline().calibrate(&Calibration::new(&[[GAIN_ONE + 3_000; COLUMNS]; ROWS], &[0; ROWS]).unwrap());
        board.pipeline().configure(&Config::shipped(&Params { modulus_pa: 300_000, ..Params::DEFAULT }).unwrap());
        board.tare();
        board.step();
        board.command().calibrate_request += 1;
        board.step();
        while board.step().mode == Mode::Press {}
        for _ in 0..wait {
            board.step();
        }
        assert_eq!(board.status().calibration.state, State::Running);
        board.command().calibrate_request += 1;
        board.step();
        board.command().torque = false;
        for _ in 0..5_000 {
            board.step();
        }
        let standing = board.status().calibration;
        let proposal = *board.pipeline().proposal();
        let ones = (0..ROWS * COLUMNS).filter(|&place| proposal.gains.get(place) == GAIN_ONE).count();
        if standing.presses != 1 || ones > 0 {
            failed.push(format!("{wait} frames after the press: {standing:?}, {ones} of the gains proposed are 1"));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// A number for a force that is held since less than 0.3 s is refused, also where another one was held before.
#[test]
fn a_number_for_another_goal_waits() {
    let mut failed = Vec::new();
    for wait_s in [0.05, 0.1, 0.2] {
        let mut board = Bench::default();
        board.tare();
        board.command().goal = newtons(2_000);
        board.run(1.5);
        board.command().goal = newtons(4_000);
        board.run(wait_s);
        board.command().shown_mn = (1e3 * board.truth().force_n) as i32;
        board.command().shown_request += 1;
        let scale = board.step().scale;
        if scale.refusal.is_none() && scale.factor_ppm.abs_diff(1_000_000) > 15_000 {
            failed.push(format!("{wait_s} s after the goal: {scale:?}"));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}
