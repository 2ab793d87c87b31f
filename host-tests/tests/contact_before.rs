//! A contact is not judged by the one before.

use fingertip::config::newtons;
use fingertip::measure::Task;
use fingertip::pressure::{Calibration, GAIN_ONE};
use fingertip::state::Mode;
use host_tests::finger::config;
use sim::effects::set::{Named, Set};
use sim::native::bench::Bench;
use sim::plant::Taxel;
use sim::scene::{Scene, read};
use sim::setup::Setup;

fn told<E: Set>(board: &mut Bench<E>) -> String {
    let (truth, status) = (board.truth(), *board.status());
    format!(
        "{:?} {:?}, true {:.3} N, read {:.3} N, doubt {}",
        status.mode,
        status.fault,
        truth.force_n,
        status.contact.force.0.to_num::<f64>(),
        status.contact.doubt
    )
}

/// Touched at 4 mm; then it is at 13 mm, and over the array's edge. A finger without that history holds the goal.
#[test]
fn another_object_at_the_edge_is_taken_hold_of() {
    let mut failed = Vec::new();
    for x_mm in [7.0, 7.25, 7.5] {
        for goal_mn in [200, 1_000] {
            for history in ["none", "let go", "slipped away"] {
                let mut setup = Setup::default();
                setup.wall.centre_x_mm = x_mm;
                let mut board: Bench = Bench::of(&setup, &config());
                board.place_object(4.0);
                board.tare();
                if history != "none" {
                    board.command().goal = newtons(goal_mn);
                    board.run(0.7);
                }
                if history == "let go" {
                    board.command().goal = newtons(0);
                    board.run(0.7);
                }
                board.place_object(13.0);
                board.command().goal = newtons(goal_mn);
                board.run(2.0);
                let off = (board.truth().force_n - 1e-3 * f64::from(goal_mn)).abs();
                if off > 0.02 || board.status().mode != Mode::Force {
                    failed.push(format!("{history}, {x_mm} mm, goal {goal_mn} mN: {}", told(&mut board)));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

fn scene(x_mm: f64) -> Scene {
    let text = format!(
        "about = \"a plate\"\nduration_s = 1.0\n[object]\ndistance_mm = 5.0\ncentre_x_mm = {x_mm:?}\n\
        [[script]]\nat_s = 0.0\ngoal_n = 0.0\n"
    );
    read("t.toml", &text, &[]).unwrap()
}

/// A contact at the edge was fitted; a press that measures touches in the middle: what its end reads is not that times
/// the ratio of the contact before.
#[test]
fn a_press_that_measures_loses_the_fit() {
    let mut board: Bench<Named> = Bench::new(&scene(6.8)).unwrap();
    board.tare();
    board.command().goal = newtons(2_000);
    board.run(1.0);
    board.request(Task::Press);
    board.step();
    while board.step().contact.force >= newtons(15) {}
    let travel_mm = board.truth().travel_mm;
    board.exchange(&scene(0.0)).unwrap();
    board.place(travel_mm);
    for _ in 0..20_000 {
        let status = board.step();
        let (read, held) = (status.contact.force.0.to_num::<f64>(), board.truth().force_n);
        assert!(status.fault.is_none() && read < 1.1 * held + 0.1, "{}", told(&mut board));
    }
}

/// A finger holds an object, is switched off, the object is taken away, and it is switched on before another, at the
/// array's edge. What hysteresis and creep left of the first one reads as a contact in the air, which is where the surface
/// is taken to be.
#[test]
fn what_is_left_of_a_contact_in_the_air_is_no_surface() {
    let mut failed = Vec::new();
    for seed in 0..4 {
        let text = format!(
            "about = \"a finger\"\nseed = {seed}\nduration_s = 1.0\n[object]\ndistance_mm = 5.0\ncentre_x_mm = 6.5\n\
            [effects.noise]\nrms_codes = 1.5\n[effects.dry_friction]\ntorque_mnm = 0.15\n[effects.hysteresis]\n\
            width_percent = 6\n[effects.creep]\nrate_percent_per_decade = 3\n[effects.gain_spread]\nrms_percent = 6\n\
            [[script]]\nat_s = 0.0\ngoal_n = 0.0\n"
        );
        let mut swings = [0.0; 2];
        for (history, swing) in [false, true].into_iter().zip(&mut swings) {
            let mut board: Bench<Named> = Bench::new(&read("t.toml", &text, &[]).unwrap()).unwrap();
            board.tare();
            if history {
                board.command().goal = newtons(6_000);
                board.run(3.0);
                board.command().torque = false;
                board.command().goal = newtons(0);
                board.run(0.3);
                board.place_object(60.0);
                board.place(0.0);
                board.run(0.01);
                board.place_object(5.0);
                board.command().torque = true;
            }
            board.command().goal = newtons(1_000);
            board.run(2.0);
            let (mut least, mut most) = (f64::MAX, 0.0_f64);
            for _ in 0..10_000 {
                board.step();
                let force_n = board.truth().force_n;
                (least, most) = (least.min(force_n), most.max(force_n));
            }
            *swing = most - least;
        }
        if swings[1] > swings[0] + 0.05 {
            failed.push(format!("finger {seed}, from 2 to 3 s after the goal of 1 N: the force swings by {swings:.3?} N without and with a history"));
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Six dead taxels are more than allowed; a mask leaves them out. It is given while frames already show them.
#[test]
fn taxels_that_are_masked_are_no_fault_any_more() {
    let mut mask = [0; 10];
    mask[4] = 0b00_1111_1100;
    let calibration = Calibration::new(&[[GAIN_ONE; 10]; 10], &mask).unwrap();
    for frames_before in [0, 5] {
        let mut board = Bench::default();
        board.harm(|faults| (2..8).for_each(|column| faults.array.taxels[4][column] = Taxel::Dead));
        for _ in 0..frames_before {
            board.step();
        }
        board.pipeline().calibrate(&calibration);
        board.tare();
        board.step();
        let status = board.step();
        let again = board.pipeline().array().picture().bad_again;
        assert_eq!((status.fault, again), (None, 0), "{frames_before} frames before");
    }
}
