//! The mode on the simulated finger: true modulus, friction, encoder and readout are the plant's.

use fingertip::identify::{Identification, Modulus, Refusal};
use fingertip::params::Params;
use fingertip::shipped::Config;
use fingertip::state::Mode;
use host_tests::finger::config;
use sim::native::bench::Bench;
use sim::plant::{Setup, Taxel};

/// The longest that a measurement takes.
const FRAMES_MAX: u32 = 60_000;

fn board(setup: &Setup) -> Bench {
    let mut board = Bench::of(setup, &config());
    board.tare();
    board.step();
    board
}

fn with(change: impl FnOnce(&mut Setup)) -> Setup {
    let mut setup = Setup::default();
    change(&mut setup);
    setup
}

/// Asks for a measurement and waits for its end.
fn identify(board: &mut Bench) -> Identification {
    board.command().identify_request += 1;
    for _ in 0..FRAMES_MAX {
        let status = board.step();
        if status.identification.number() > 1 {
            return status.identification;
        }
    }
    panic!("no end after {FRAMES_MAX} frames");
}

fn measured(setup: &Setup) -> Modulus {
    match identify(&mut board(setup)) {
        Identification::Done(modulus) => modulus,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_true_modulus_is_found_whatever_the_parameters_say() {
    for percent in [-30, -20, -10, 0, 10, 20, 30, 40] {
        let modulus_kpa = 250.0 * (1.0 + f64::from(percent) / 100.0);
        let found = measured(&with(|setup| setup.tip.modulus_kpa = modulus_kpa));
        let error_kpa = found.modulus.0.to_num::<f64>() - modulus_kpa;
        let sigma_kpa = found.sigma.0.to_num::<f64>();
        let contact_mm = found.contact.0.to_num::<f64>();
        println!(
            "{modulus_kpa} kPa: {error_kpa:+.3} +- {sigma_kpa:.3} kPa, touched at {contact_mm:.4} mm, {} points",
            found.points
        );
        assert!(error_kpa.abs() <= 0.01 * modulus_kpa);
        assert!(error_kpa.abs() <= 3.0 * sigma_kpa);
        assert!((0.00099..=0.003).contains(&(sigma_kpa / modulus_kpa)));
        assert!((contact_mm - 5.0).abs() < 0.01, "{contact_mm} mm");
    }
}

#[test]
fn soft_stiff_and_off_centre() {
    for (modulus_kpa, x_mm, y_mm) in [(40.0, 0.0, 0.0), (1_500.0, 0.3, -0.2), (250.0, 1.5, 1.0), (250.0, -3.0, 0.5)] {
        let setup = with(|setup| {
            setup.tip.modulus_kpa = modulus_kpa;
            (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (x_mm, y_mm);
        });
        let found = measured(&setup);
        let share = found.modulus.0.to_num::<f64>() / modulus_kpa - 1.0;
        println!("{modulus_kpa} kPa at {x_mm}, {y_mm} mm: {share:+.5}, {} points", found.points);
        assert!(share.abs() <= 0.01, "{modulus_kpa} kPa at {x_mm}, {y_mm} mm: {share}");
    }
}

#[test]
fn from_a_held_force_and_back_to_it() {
    let mut board = board(&Setup::default());
    board.command().goal = crate::newtons(2.0);
    for _ in 0..6_000 {
        board.step();
    }
    assert_eq!(board.step().mode, Mode::Force);
    assert!(matches!(identify(&mut board), Identification::Done(_)));
    for _ in 0..3_000 {
        board.step();
    }
    assert_eq!(board.step().mode, Mode::Force);
    assert!((board.truth().force_n - 2.0).abs() < 0.02);
}

#[test]
fn it_presses_slowly_no_harder_than_allowed_and_lets_go() {
    let mut board = board(&with(|setup| setup.tip.modulus_kpa = 350.0));
    board.command().identify_request += 1;
    let (mut peak_n, mut fastest_mm_per_s) = (0.0_f64, 0.0_f64);
    let mut frames = 0;
    while board.step().identification == Identification::Running || frames == 0 {
        frames += 1;
        peak_n = peak_n.max(board.truth().force_n);
        if board.truth().force_n > 0.2 {
            fastest_mm_per_s = fastest_mm_per_s.max(board.truth().speed_mm_per_s);
        }
    }
    assert!((6.9..=7.05).contains(&peak_n), "{peak_n} N");
    assert!((1.5..=6.0).contains(&fastest_mm_per_s), "{fastest_mm_per_s} mm/s");
    for _ in 0..3_000 {
        board.step();
    }
    assert_eq!((board.step().mode, board.truth().force_n), (Mode::Release, 0.0));
}

#[test]
fn an_edge_a_bad_taxel_and_nothing_to_touch_are_refused() {
    let refused = |setup: &Setup, change: fn(&mut Bench)| {
        let mut board = board(setup);
        change(&mut board);
        identify(&mut board)
    };
    for x_mm in [6.0, 7.5, 8.5] {
        let setup = with(|setup| setup.wall.centre_x_mm = x_mm);
        assert_eq!(refused(&setup, |_| {}), Identification::Refused(Refusal::Edge), "{x_mm} mm");
    }
    let dead: fn(&mut Bench) = |board| board.harm(|faults| faults.array.taxels[9][0] = Taxel::Dead);
    assert_eq!(refused(&Setup::default(), dead), Identification::Refused(Refusal::BadTaxels));
    let nothing = with(|setup| setup.wall.distance_mm = 40.0);
    assert_eq!(refused(&nothing, |_| {}), Identification::Refused(Refusal::NoContact));
    // The travel ends 0.2 mm deep.
    let late = with(|setup| setup.wall.distance_mm = 19.6);
    assert_eq!(refused(&late, |_| {}), Identification::Refused(Refusal::Span));
}

#[test]
fn a_motor_too_weak_for_the_press_gives_what_its_points_support() {
    let weak = |current_max_ma| {
        let params = Params { current_max_ma, ..Params::DEFAULT };
        let mut board = Bench::of(&Setup::default(), &Config::shipped(&params).unwrap());
        board.tare();
        board.step();
        identify(&mut board)
    };
    assert_eq!(weak(36), Identification::Refused(Refusal::Stalled));
    let Identification::Done(found) = weak(150) else { panic!("refused") };
    assert!((found.modulus.0.to_num::<f64>() / 250.0 - 1.0).abs() < 0.01);
    assert!((50..250).contains(&found.points), "{} points", found.points);
}

#[test]
fn torque_off_a_fault_and_new_parameters_interrupt_it() {
    let started = || {
        let mut board = board(&Setup::default());
        board.command().identify_request += 1;
        for _ in 0..2_500 {
            assert_eq!(board.step().mode, Mode::Press);
        }
        board
    };
    let interrupted = Identification::Refused(Refusal::Interrupted);
    let mut board = started();
    board.command().torque = false;
    let status = board.step();
    assert_eq!((status.mode, status.duty.0, status.identification), (Mode::Off, 0, interrupted));
    let mut board = started();
    board.harm(|faults| faults.array.saturated = true);
    let status = board.step();
    assert_eq!((status.mode, status.duty.0, status.identification), (Mode::Fault, 0, interrupted));
    let mut board = started();
    board.pipeline().configure(&config());
    assert_eq!(board.step().identification, interrupted);
}

#[test]
fn without_torque_it_is_refused() {
    let mut board = Bench::default();
    assert_eq!(board.step().identification, Identification::None);
    board.command().identify_request += 1;
    let status = board.step();
    assert_eq!((status.mode, status.identification), (Mode::Off, Identification::Refused(Refusal::NotReady)));
}
