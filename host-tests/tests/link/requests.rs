//! Requests on the bus: what cannot be done is answered with error 1, what is accepted is passed on, and how it went
//! can be read.

use fingertip::calibrate::{Refusal as Unfit, Standing, State, scale};
use fingertip::command::Command;
use fingertip::identify::{Identification, Refusal};
use fingertip::pipeline::Taring;
use fingertip::shipped::{Gains, address};
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

#[test]
fn identify_is_refused_without_torque_or_tare() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(address::IDENTIFY, &[1]), RESULT);
    bench.status.limits.set(Limits::NOT_TARED);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert_eq!(bench.write(address::IDENTIFY, &[1]), RESULT);
    assert_eq!(bench.write(address::IDENTIFY, &[0]), Ok(()), "0 asks for nothing");

    // A tare is under way, or accepted: the measurement waits for its end.
    bench.status.mode = Mode::Tare;
    assert_eq!(bench.write(address::IDENTIFY, &[1]), Ok(()));
    bench.status.mode = Mode::Off;
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    bench.write(address::TARE, &[1]).expect("a tare");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("on");
    assert_eq!(bench.write(address::IDENTIFY, &[1]), Ok(()));
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

#[test]
fn an_old_outcome_is_never_taken_for_that_of_a_new_request() {
    let mut bench = Bench::new();
    bench.status.identification = Identification::Refused(Refusal::NoContact);
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.number(address::IDENTIFY_STATE, 1), 3);
    assert_eq!(bench.write(address::IDENTIFY, &[1]), Ok(()));
    assert_eq!(bench.number(address::IDENTIFY_STATE, 1), 1);
    bench.take_up();
    assert_eq!(bench.number(address::IDENTIFY_STATE, 1), 3);
}

/// A press needs torque and a tare, as a measurement of the modulus; what it proposes is accepted with torque off, where
/// there is something.
#[test]
fn a_calibration_is_asked_for_and_accepted_where_that_can_be() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(address::CALIBRATE, &[1]), RESULT, "no torque");
    assert_eq!(bench.write(address::CALIBRATE, &[3]), RESULT, "no proposal");
    assert_eq!(bench.write(address::SCALE, &[3]), RESULT, "no number");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("a write");
    assert_eq!(bench.write(address::CALIBRATE, &[1]), Ok(()));
    assert_eq!((bench.server.command().calibrate_request, bench.number(address::CALIBRATE_STATE, 1)), (1, 1));
    bench.status.calibration =
        Standing { state: State::Refused(Unfit::Soft), presses: 1, reached: 70, ..Standing::default() };
    bench.status.taken.calibrate = 1;
    bench.status.scale = scale::Standing { points: 2, factor_ppm: 1_250_000, sigma_ppm: 900, refusal: None };
    assert_eq!((bench.number(address::CALIBRATE_STATE, 1), bench.number(address::CALIBRATE_REFUSAL, 1)), (3, 1));
    assert_eq!(bench.number(address::CALIBRATE_TAXELS, 2), 70);
    for place in 0..100 {
        assert!(bench.proposal.gains.set(place, 12_000 + 50 * place as u16));
        bench.proposal.sigmas[place / 10][place % 10] = place as u8;
    }
    assert_eq!(bench.number(address::PROPOSED_GAINS + 2 * 99, 2), 12_000 + 50 * 99);
    assert_eq!(bench.number(address::PROPOSED_SIGMAS + 42, 1), 42);
    // With torque on neither is accepted, nor while a press is worked out.
    assert_eq!(bench.write(address::CALIBRATE, &[3]), Err(7));
    assert_eq!(bench.write(address::SCALE, &[3]), Err(7));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("a write");
    bench.server.take_actions();
    let standing = bench.status.calibration;
    bench.status.calibration.state = State::Running;
    assert_eq!(bench.write(address::CALIBRATE, &[3]), RESULT);
    bench.status.calibration = standing;
    let params = bench.server.settings().record.params;
    assert_eq!(bench.server.settings().record.gains, Gains::ONE);
    assert_eq!(bench.write(address::CALIBRATE, &[3]), Ok(()));
    assert_eq!(bench.server.settings().record.gains, bench.proposal.gains);
    assert_eq!((bench.server.settings().record.params, bench.number(address::SAVED_STATE, 1)), (params, 1));
    let actions = bench.server.take_actions();
    assert!(actions.calibrate && !actions.configure);
    bench.take_up();
    // A quarter more force for each code: fewer codes for a kPa, and a tip that is harder by that.
    assert_eq!(bench.write(address::SCALE, &[3]), Ok(()));
    let after = bench.server.settings().record.params;
    assert_eq!((after.codes_per_kpa_milli, after.modulus_pa), (19_200, 312_500));
    assert!(bench.server.take_actions().configure);
}

/// What the factor would make of a parameter must be in its range.
#[test]
fn a_factor_that_leads_out_of_range_changes_nothing() {
    let mut bench = Bench::new();
    bench.write_parameter("modulus_pa", 1_900_000);
    bench.take_up();
    bench.status.scale = scale::Standing { points: 1, factor_ppm: 1_100_000, sigma_ppm: 900, refusal: None };
    let before = *bench.server.settings();
    assert_eq!(bench.write(address::SCALE, &[3]), Err(4));
    assert_eq!(*bench.server.settings(), before);
}

#[test]
fn a_scale_s_number_is_passed_on_and_waits_for_the_loop() {
    let mut bench = Bench::new();
    assert_eq!(bench.number(address::SCALE_POINTS, 1), 0);
    bench.write(address::SCALE_SHOWS_MN, &1_234i32.to_le_bytes()).expect("a write");
    let command = bench.server.command();
    assert_eq!((command.shown_request, command.shown_mn, bench.number(address::SCALE_POINTS, 1)), (1, 1_234, 255));
    bench.status.taken.shown = 1;
    bench.status.scale.refusal = Some(scale::Refusal::Contradiction);
    assert_eq!((bench.number(address::SCALE_POINTS, 1), bench.number(address::SCALE_REFUSAL, 1)), (0, 5));
    for address in [address::CALIBRATE, address::SCALE] {
        bench.write(address, &[2]).expect("a write");
    }
    assert_eq!(bench.server.command().forget_request, 2);
}
