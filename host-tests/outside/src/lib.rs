//! A project of somebody else: the first example of the core's front page, under the core as a package.
#![doc = include_str!("../../../src/README.md")]

/// Without the feature `measure` every request for a motion is acknowledged and refused with a reason.
#[test]
fn a_motion_that_is_not_built_in_is_refused() {
    use fingertip::command::Command;
    use fingertip::frame::{Frame, Sense};
    use fingertip::measure::{Ended, MeasureState, Task};
    use fingertip::pipeline::{Pipeline, Taring};
    use fingertip::{config::newtons, params::Params, shipped};

    let config = shipped::Config::shipped(&Params { direction_confirmed: 1, ..Params::DEFAULT }).expect("defaults");
    for task in [Task::Jog, Task::Strokes, Task::Press] {
        let mut finger = Pipeline::new(&config);
        let mut command = Command { tare_request: 1, ..Command::default() };
        for sequence in 1..2_020 {
            let mut frame = Frame { sequence, ..Frame::EMPTY };
            let places = (0..=shipped::ROWS).flat_map(|slot| (0..shipped::COLUMNS).map(move |column| (slot, column)));
            places
                .for_each(|(slot, column)| frame.set_code(slot, column, if slot < shipped::ROWS { 412 } else { 372 }));
            finger.step(&frame, &Sense { supply_mv: 6_500, ..Sense::default() }, &command);
            if finger.status().tare == Taring::Done && sequence > 2_000 {
                (command.torque, command.goal) = (task == Task::Press, newtons(1_000));
                command.measure_request = if sequence > 2_005 { task.after(0) } else { 0 };
            }
        }
        let status = finger.status();
        assert_eq!((status.fault, status.taken.measure), (None, task.after(0)), "{task:?}");
        assert_eq!((status.measure.state, status.measure.ended), (MeasureState::Ended, Ended::NotReady), "{task:?}");
    }
}
