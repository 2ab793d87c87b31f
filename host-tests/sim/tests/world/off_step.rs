//! Between two steps: what a row feels and what the encoder reads a little before or behind the end of the last one.

use crate::bench::{run, world};
use sim::bridge::Bridge;
use sim::effects::set::Named;
use sim::world::World;

const ROW: usize = 4;
/// Full drive into a wall.
const DRIVE: Bridge = Bridge::Driven { duty: 1.0 };

fn running_in() -> World<Named> {
    let mut world = world("[object]\ndistance_mm = 0.0\n");
    world.fingers_mut()[0].place(1.0);
    world.fingers_mut()[0].launch(50.0);
    world
}

#[test]
fn what_lies_between_two_steps_is_what_shorter_steps_come_to() {
    let mut coarse = running_in();
    run(&mut coarse, 100e-6, 1, DRIVE);
    for (off_s, short_steps) in [(-60e-6, 4), (-10e-6, 9), (0.0, 10), (40e-6, 14), (100e-6, 20)] {
        let mut fine = running_in();
        run(&mut fine, 10e-6, short_steps, DRIVE);
        let (row, there) = (coarse.row_off_kpa(0, off_s, ROW), fine.row_kpa(0, f64::INFINITY, ROW));
        for (here, there) in row.into_iter().zip(there) {
            // 10 us of the way change it by 0.05 %.
            assert!((here - there).abs() < 5e-5 * there.max(1.0), "{here} and {there} kPa at {off_s} s");
        }
        if off_s >= 0.0 {
            assert_eq!(
                coarse.fingers_mut()[0].count_ahead(off_s),
                fine.fingers_mut()[0].count_ahead(0.0),
                "at {off_s} s"
            );
        }
    }
}

#[test]
fn before_the_first_step_nothing_moves() {
    let mut world = running_in();
    assert_eq!(world.row_off_kpa(0, -1.0, ROW), world.row_kpa(0, f64::INFINITY, ROW));
}
