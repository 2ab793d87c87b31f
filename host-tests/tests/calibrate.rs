//! The press that calibrates the taxels, on the simulated finger of one kind: a characteristic that is no line, and
//! requests that meet.

use fingertip::calibrate::{Refusal, State};
use fingertip::identify::Identification;
use fingertip::params::Params;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{Calibration, Config, Gains, TAXELS};
use fingertip::state::Mode;
use sim::native::bench::Bench;
use sim::setup::Setup;

/// The longest that a press takes, with what is worked out after it.
const FRAMES_MAX: u32 = 60_000;

/// Gains in force that are right for nobody: from 0.85 to 1.15.
fn wrong() -> Gains {
    let mut gains = Gains::ONE;
    for place in 0..TAXELS {
        let off = ((place * 37) % 31) as i32 - 15;
        assert!(gains.set(place, (i32::from(GAIN_ONE) + off * i32::from(GAIN_ONE) / 100) as u16));
    }
    gains
}

fn board(setup: &Setup, params: &Params, gains: &Gains) -> Bench {
    let mut board = Bench::of(setup, &Config::shipped(params).unwrap());
    board.pipeline().calibrate(&Calibration::of(gains));
    board.tare();
    board.step();
    board
}

fn press(board: &mut Bench) -> State {
    board.command().calibrate_request += 1;
    for _ in 0..FRAMES_MAX {
        let status = board.step();
        if status.taken.calibrate == board.command().calibrate_request && status.calibration.state.number() > 1 {
            return status.calibration.state;
        }
    }
    panic!("no end after {FRAMES_MAX} frames");
}

/// How far proposed gains of taxels that are known to 2 % are off what they should be, at worst.
fn worst_off(board: &mut Bench) -> (f64, usize) {
    let proposal = board.pipeline().proposal();
    let known = (0..TAXELS).filter(|place| proposal.sigmas[place / 10][place % 10] < 20);
    let off: Vec<f64> =
        known.map(|place| (f64::from(proposal.gains.get(place)) / f64::from(GAIN_ONE) - 1.0).abs()).collect();
    (off.iter().copied().fold(0.0, f64::max), off.len())
}

/// All taxels conduct alike, so whatever gains are in force, a gain of 1 is right for each: also where the force grows
/// with the square of the code. There wrong gains bend the lines, too: what is left of that goes with a second round.
#[test]
fn wrong_gains_are_set_right_also_of_a_curve() {
    for (growth, curve_permille, share) in [(0.0, 0, 0.02), (1.0, 1_000, 0.05), (3.3, 3_300, 0.08)] {
        let mut setup = Setup::default();
        setup.array.growth = growth;
        let steeper = if growth > 0.0 { 2.5 } else { 1.0 };
        setup.array.siemens_per_kpa *= steeper;
        let codes_per_kpa_milli = (24_000.0 * steeper) as i32;
        let params = Params { curve_permille, codes_per_kpa_milli, ..Params::DEFAULT };
        let mut board = board(&setup, &params, &wrong());
        assert_eq!(press(&mut board), State::Done, "growth {growth}");
        let (worst, known) = worst_off(&mut board);
        println!("growth {growth}: {known} taxels, the worst {:.2} % off", 100.0 * worst);
        assert!(known > 40 && worst < share, "growth {growth}: {worst} of {known}");
        let gains = board.pipeline().proposal().gains;
        for _ in 0..5_000 {
            board.step();
        }
        board.command().torque = false;
        board.pipeline().calibrate(&Calibration::of(&gains));
        board.tare();
        assert_eq!(press(&mut board), State::Done, "growth {growth}");
        let (worst, known) = worst_off(&mut board);
        println!("    again: {known} taxels, the worst {:.2} % off", 100.0 * worst);
        assert!(known > 40 && worst < 0.02, "growth {growth}: {worst} of {known}");
    }
}

#[test]
fn a_modulus_asked_for_meanwhile_waits_and_so_does_a_press() {
    let mut board = board(&Setup::default(), &Params::DEFAULT, &Gains::ONE);
    board.command().calibrate_request += 1;
    board.command().identify_request += 1;
    let mut modes = vec![Mode::Off];
    for _ in 0..2 * FRAMES_MAX {
        let status = board.step();
        if modes.last() != Some(&status.mode) {
            modes.push(status.mode);
        }
        let both = status.identification.number() > 1 && status.calibration.state.number() > 1;
        if both && status.taken.calibrate == 1 && status.taken.identify == 1 {
            assert!(matches!(status.identification, Identification::Done(_)), "{:?}", status.identification);
            assert_eq!(status.calibration.state, State::Done);
            assert_eq!(modes, [Mode::Off, Mode::Press, Mode::Release], "one press right behind the other");
            return;
        }
    }
    panic!("one of them never came: {modes:?}");
}

/// A press that is asked for while the one before is worked out begins when that is done, and counts beside it.
#[test]
fn the_next_press_waits_until_the_last_one_is_worked_out() {
    let mut board = board(&Setup::default(), &Params::DEFAULT, &Gains::ONE);
    board.command().calibrate_request += 1;
    while board.step().mode != Mode::Press {}
    while board.step().mode == Mode::Press {}
    board.command().calibrate_request += 1;
    let mut working = 0;
    while board.step().mode != Mode::Press {
        working += 1;
        assert!(working < 4_000);
    }
    assert!(working > 1_000, "{working} frames of work");
    assert_eq!(board.status().calibration.presses, 1);
    for _ in 0..FRAMES_MAX {
        if board.step().calibration.state != State::Running {
            break;
        }
    }
    let standing = board.status().calibration;
    assert_eq!((standing.state, standing.presses), (State::Done, 2));
    // What is forgotten is gone at once, and does not come back with the next press.
    board.command().forget_request += 1;
    let standing = board.step().calibration;
    assert_eq!((standing.presses, standing.reached), (0, 0));
    assert_eq!(worst_off(&mut board).1, 0);
    assert_eq!(press(&mut board), State::Done);
    assert_eq!(board.status().calibration.presses, 1);
    // Forgotten in the middle of the work: nothing is proposed.
    board.command().calibrate_request += 1;
    while board.step().mode != Mode::Press {}
    while board.step().mode == Mode::Press {}
    for _ in 0..1_000 {
        board.step();
    }
    board.command().forget_request += 1;
    let standing = board.step().calibration;
    assert_eq!((standing.state, standing.presses), (State::Refused(Refusal::Interrupted), 0));
    for _ in 0..3_000 {
        board.step();
    }
    assert_eq!(worst_off(&mut board).1, 0);
}

#[test]
fn without_torque_or_tare_it_is_refused() {
    let mut board = Bench::default();
    assert_eq!(board.step().calibration.state, State::None);
    board.command().calibrate_request += 1;
    let status = board.step();
    assert_eq!((status.mode, status.calibration.state), (Mode::Off, State::Refused(Refusal::NotReady)));
}

/// The force stays below what is allowed, and the tip lets go.
#[test]
fn it_presses_no_harder_than_allowed_and_lets_go() {
    let params = Params { force_max_mn: 4_000, ..Params::DEFAULT };
    let mut board = board(&Setup::default(), &params, &wrong());
    board.command().calibrate_request += 1;
    let mut peak_n = 0.0_f64;
    for _ in 0..20_000 {
        board.step();
        peak_n = peak_n.max(board.truth().force_n);
    }
    let status = board.step();
    assert_eq!((status.calibration.state, status.mode, board.truth().force_n), (State::Done, Mode::Release, 0.0));
    assert!((3.7..4.2).contains(&peak_n), "{peak_n} N");
}

/// What ends the calibration ends the press: the tip does not go on pressing.
#[test]
fn a_calibration_that_ends_early_ends_its_press() {
    for (forgets, refusal) in [(true, Refusal::Interrupted), (false, Refusal::Lost)] {
        let mut board = board(&Setup::default(), &Params::DEFAULT, &Gains::ONE);
        board.command().calibrate_request += 1;
        while board.truth().force_n < 1.0 {
            board.step();
        }
        if forgets {
            board.command().forget_request += 1;
        } else {
            board.place_object(40.0);
        }
        board.run(0.01);
        let status = board.step();
        assert_eq!((status.calibration.state, status.mode), (State::Refused(refusal), Mode::Release));
    }
}
