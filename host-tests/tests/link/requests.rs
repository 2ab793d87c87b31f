//! Requests on the bus: what cannot be done is answered with error 1, what is accepted is passed on, and how it went
//! can be read.

use fingertip::capture::State;
use fingertip::command::Command;
use fingertip::measure::{Ended, MeasureStatus, Task};
use fingertip::pipeline::Taring;
use fingertip::shipped::address;
use fingertip::state::{Fault, Limits, Mode};

use crate::bench::{Bench, ID, packet};

const RESULT: Result<(), u8> = Err(1);

fn faulted() -> Bench {
    let mut bench = Bench::new();
    bench.set_fault(Some(Fault::Bridge));
    bench
}

/// Tare, clear, save in one write.
fn requests(bench: &mut Bench, tare: u8, clear: u8, save: u8) -> Result<(), u8> {
    bench.write(address::TARE, &[tare, clear, save])
}

#[test]
fn a_tare_in_a_fault_is_refused() {
    let mut bench = faulted();
    let before = bench.server.command();
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
    assert_eq!(bench.server.command(), before);
    assert_eq!(bench.number(address::RESULT_ERRORS, 2), 1);
    assert_eq!(bench.write(address::TARE, &[0]), Ok(()), "0 asks for nothing");
}

#[test]
fn a_tare_with_or_after_the_clearing_of_a_fault_is_taken() {
    let mut bench = faulted();
    assert_eq!(requests(&mut bench, 1, 1, 0), Ok(()));
    let Command { tare_request, clear_request, torque, .. } = bench.server.command();
    assert_eq!((tare_request, clear_request, torque), (1, 1, false));

    // One after the other, before the loop has looked.
    let mut bench = faulted();
    assert_eq!(bench.write(address::CLEAR_FAULT, &[1]), Ok(()));
    assert_eq!(bench.write(address::TARE, &[1]), Ok(()));
    bench.take_up();
    assert_eq!((bench.number(address::FAULT, 1), bench.number(address::TARE_STATE, 1)), (0, 2));

    // The loop took the clear up, and the fault is back.
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
}

/// Every force would read less by what pressed during the tare. The host may insist.
#[test]
fn torque_is_refused_after_a_tare_while_something_touched() {
    let mut bench = Bench::new();
    let tare = |bench: &mut Bench, value| {
        let before = bench.server.command().tare_request;
        assert_eq!(bench.write(address::TARE, &[value]), Ok(()));
        assert_eq!(bench.server.command().tare_request, before + 1, "{value}");
        bench.take_up();
    };
    bench.status.limits.set(Limits::TARED_TOUCHING);
    tare(&mut bench, 1);
    assert!(!bench.server.command().tare_forced);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[0]), Ok(()));
    // Another tare, which the loop has not begun yet, may be clean: the loop decides.
    assert_eq!(bench.write(address::TARE, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    tare(&mut bench, 2);
    assert_eq!(bench.write(address::TARE, &[0]), Ok(()), "0 asks for nothing");
    assert!(bench.server.command().tare_forced);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::TARE, &[2]), Err(7), "not while torque is on");
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    tare(&mut bench, 1);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT, "the next tare is not forced");
    assert_eq!(bench.write(address::TARE, &[3]), Err(4));
}

#[test]
fn torque_and_goals_wait_until_the_fault_is_seen_to_be_cleared() {
    let mut bench = faulted();
    let goal = 1_000i32.to_le_bytes();
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), RESULT, "the fault would take it back");
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[&goal[..], &[0, 1]].concat()), RESULT);
    assert_eq!(bench.server.command().clear_request, 0, "all or nothing");
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &0i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.write(address::CLEAR_FAULT, &[1]), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), RESULT);
    bench.take_up();
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal), Ok(()));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_000);
}

/// What the link knows to be impossible is refused at once; what a tare under way may make possible is passed on.
#[test]
fn a_motion_is_refused_where_it_cannot_begin() {
    const JOG: u8 = 1;
    const STROKES: u8 = 2;
    const PRESS: u8 = 3;
    let ask = |bench: &mut Bench, task: u8| bench.write(address::MEASURE, &[task]);
    let all = |bench: &mut Bench| [JOG, STROKES, PRESS].map(|task| ask(bench, task).is_ok());
    let mut bench = Bench::new();
    bench.status.limits.set(Limits::NOT_TARED);
    assert_eq!(all(&mut bench), [false; 3], "not tared, torque off");
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT, "not tared");
    bench.status.mode = Mode::Tare;
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque waits for the tare");
    assert_eq!(all(&mut bench), [false, false, true], "a press waits for the tare");
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    assert_eq!(all(&mut bench), [false; 3], "during a tare, torque off");
    let mut bench = Bench::new();
    bench.write(address::TARE, &[1]).expect("a tare");
    assert_eq!(all(&mut bench), [false; 3], "a tare that the loop has not seen, torque off");
    let mut bench = Bench::new();
    assert_eq!(all(&mut bench), [true, true, false], "tared, torque off");
    let mut bench = Bench::new();
    bench.write(address::TORQUE_ENABLE, &[1]).expect("on");
    assert_eq!(all(&mut bench), [false, false, true], "torque on");
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(all(&mut bench), [false; 3], "a fault");
    let mut bench = Bench::new();
    bench.capture.state = State::Recording;
    assert_eq!(all(&mut bench), [true, false, false], "the capture's memory is in use");
    // Stopping is never refused.
    for bench in [&mut Bench::new(), &mut faulted(), &mut bench] {
        let before = bench.server.command().measure_request;
        assert_eq!(ask(bench, 0), Ok(()));
        let after = bench.server.command().measure_request;
        assert!(after != before && Task::of(after) == Task::Stop);
    }
    let before = bench.server.command();
    assert_eq!(ask(&mut bench, 4), Err(4));
    assert_eq!(bench.server.command(), before);
}

#[test]
fn an_old_outcome_is_never_taken_for_that_of_a_new_motion() {
    let mut bench = Bench::new();
    bench.status.measure = MeasureStatus::over(Task::Press, Ended::NoContact, -1_234);
    let read = |bench: &mut Bench| {
        [address::MEASURE_STATE, address::MEASURE_ENDED, address::MEASURE_TASK].map(|place| bench.number(place, 1))
    };
    assert_eq!((read(&mut bench), bench.number(address::MEASURE_VALUE, 4)), ([3, 11, 3], -1_234_i32 as u32));
    bench.write(address::MEASURE, &[1]).expect("a jog");
    assert_eq!(bench.number(address::MEASURE_STATE, 1), 1, "before the loop has looked");
    bench.status.measure = MeasureStatus::over(Task::Jog, Ended::Complete, 0);
    bench.take_up();
    assert_eq!((read(&mut bench), bench.number(address::MEASURE_PROGRESS, 1)), ([2, 0, 1], 100));
}

#[test]
fn a_save_is_refused_while_the_loop_drives_or_tares() {
    let mut bench = Bench::new();
    for mode in [Mode::Tare, Mode::Approach, Mode::Force, Mode::Release, Mode::Press] {
        bench.status.mode = mode;
        assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), RESULT, "{mode:?}");
        assert_eq!(bench.ask(0x06, &[0x02]).number(), 1, "{mode:?}");
        assert!(!bench.server.take_actions().save);
    }
    bench.status.mode = Mode::Off;
    assert_eq!(requests(&mut bench, 1, 0, 1), RESULT, "the tare comes first");
    assert_eq!(requests(&mut bench, 1, 0, 0), Ok(()));
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), RESULT, "the tare that was accepted");
    bench.take_up();
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), Ok(()));
    // The save waits for the firmware: nothing may come between.
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), RESULT);
    assert_eq!(bench.write(address::TARE, &[1]), RESULT);
    bench.server.take_actions();
    bench.set_fault(Some(Fault::Bridge));
    assert_eq!(bench.write(address::SAVE_PARAMETERS, &[1]), Ok(()), "the motor is off in a fault");
}

/// A write to several has no answer, so how it went is read: what was refused is counted, what was taken has its state.
#[test]
fn how_an_unanswered_request_went_can_be_read() {
    let mut bench = Bench::new();
    let sync_write = |bench: &mut Bench| {
        let params = [&address::TARE.to_le_bytes()[..], &[1, 0, ID, 1]].concat();
        assert!(bench.hear(&packet(254, 0x83, &params)).is_empty());
    };
    assert_eq!(bench.number(address::TARE_STATE, 1), 0);
    sync_write(&mut bench);
    assert_eq!(bench.number(address::TARE_STATE, 1), 1, "before the loop has looked");
    bench.take_up();
    assert_eq!(bench.number(address::TARE_STATE, 1), 2);
    // A fault comes between: the link let it through, the loop refuses it.
    sync_write(&mut bench);
    bench.set_fault(Some(Fault::Bridge));
    bench.take_up();
    assert_eq!((bench.status.tare, bench.number(address::TARE_STATE, 1)), (Taring::Refused, 3));
    // With the fault known the link refuses it.
    sync_write(&mut bench);
    assert_eq!((bench.number(address::TARE_STATE, 1), bench.number(address::RESULT_ERRORS, 2)), (3, 1));
}
