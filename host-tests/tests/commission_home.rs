//! Measuring the drive leaves the tip where it was, however often it is done, on drives that are not what the controller
//! was told.

use fingertip::commission::{Commissioning, Task};
use fingertip::params::Params;
use fingertip::shipped::Config;
use sim::native::bench::Bench;
use sim::setup::Setup;

const TIMES: usize = 9;
const FRAMES: usize = 100_000;

/// Where the tip is.
fn place(board: &mut Bench) -> f64 {
    board.truth().travel_mm
}

/// Measures once; how far the tip went from where it was.
fn measure(board: &mut Bench) -> f64 {
    let begun = place(board);
    let asked = board.command().commission_request;
    board.command().commission_request = Task::Measure.after(asked);
    let mut farthest = 0.0_f64;
    for _ in 0..FRAMES {
        let status = board.step();
        farthest = farthest.max((place(board) - begun).abs());
        match status.commissioning {
            Commissioning::Running(_) => {}
            Commissioning::Measured(_) => {
                assert_eq!(status.fault, None);
                return farthest;
            }
            other => panic!("{other:?}"),
        }
    }
    panic!("it does not end");
}

#[test]
fn the_tip_ends_where_it_began_however_often_the_drive_is_measured() {
    let config = Config::shipped(&Params { direction_confirmed: 1, ..Params::DEFAULT }).unwrap();
    let (mut each, mut all, mut farthest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (ohm, torque, inertia, friction_unm) in [
        (1.0, 1.0, 1.0, 30.0),
        (1.0, 1.0, 1.0, 120.0),
        (1.0, 1.0, 1.0, 250.0),
        (0.85, 1.12, 0.95, 60.0),
        (1.2, 0.88, 1.25, 60.0),
        (0.9, 1.1, 1.2, 200.0),
        (1.1, 0.9, 0.95, 200.0),
    ] {
        let mut setup = Setup::default();
        setup.motor.resistance_ohm *= ohm;
        setup.motor.torque_nm_per_a *= torque;
        setup.motor.inertia_kg_m2 *= inertia;
        setup.motor.friction_nm = friction_unm * 1e-6;
        let mut board = Bench::of(&setup, &config);
        board.tare();
        board.command().torque = false;
        let first = place(&mut board);
        for _ in 0..TIMES {
            let before = place(&mut board);
            farthest = farthest.max(measure(&mut board));
            each = each.max((place(&mut board) - before).abs());
        }
        let after = place(&mut board) - first;
        println!("R {ohm}, k {torque}, J {inertia}, friction {friction_unm} uN m: {after:.3} mm after {TIMES}");
        all = all.max(after.abs());
    }
    println!("one leaves {each:.3} mm at most, {TIMES} leave {all:.3} mm; on its way it goes {farthest:.2} mm");
    assert!(each < 0.2 && all < 0.5 && farthest < 2.0);
}
