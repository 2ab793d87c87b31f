//! Creep that is taken off a held force: what is found of it, its bounds, and what never hears of it.

use fingertip::config::newtons;
use fingertip::control::Creep;
use fingertip::params::Params;
use fingertip::shipped::Config;
use fingertip::state::{Fault, Mode};
use fingertip::units::Newtons;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use sim::native::bench::Bench;
use sim::setup::Setup;

fn config(creep_permille: i32, creep_time_ms: i32) -> Config {
    Config::shipped(&Params { creep_permille, creep_time_ms, ..images::CONFIRMED }).unwrap()
}

fn frame_s(config: &Config) -> f64 {
    f64::from(config.timing.frame_ns) * 1e-9
}

#[test]
fn a_reading_that_creeps_as_described_gives_the_force_that_is_held() {
    for (permille, time_ms) in [(66, 10_000), (300, 500), (100, 200), (10, 100_000)] {
        let config = config(permille, time_ms);
        let (rate, tau) = (f64::from(permille) / 1e3, f64::from(time_ms) / 1e3);
        let mut creep = Creep::default();
        let mut worst = 0.0_f64;
        for frame in 0..(3.0 * tau / frame_s(&config)) as u32 {
            let reading = 2.0 * (1.0 + rate * (1.0 - (-f64::from(frame) * frame_s(&config) / tau).exp()));
            creep.observe(true, Newtons::from_bits((reading * 65_536.0) as i32), &config);
            worst = worst.max((reading - creep.force().0.to_num::<f64>() - 2.0).abs());
        }
        // Units of 15 uN, the share of a frame's way, and the rate of the filter to 2^-10 of itself.
        assert!(worst < 2.0 * rate * 2e-3 + 1e-4, "{permille} {time_ms}: {worst} N");
        assert!(creep.force().0.to_num::<f64>() > 1.8 * rate, "there was something to take off");
    }
}

#[test]
fn at_rate_zero_and_where_nothing_is_held_there_is_none() {
    let mut creep = Creep::default();
    for _ in 0..10_000 {
        creep.observe(true, newtons(5_000), &config(0, 500));
    }
    assert_eq!(creep, Creep::default());
    for _ in 0..10_000 {
        creep.observe(true, newtons(5_000), &config(100, 500));
    }
    assert!(creep.force() > newtons(400));
    creep.observe(false, newtons(5_000), &config(100, 500));
    assert_eq!(creep, Creep::default());
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn it_stays_between_none_and_its_share_of_the_largest_reading(
        readings in proptest::collection::vec((any::<i32>(), 1_u32..3_000), 1..12),
        permille in 0..=300, time_ms in 50..=600_000,
    ) {
        let config = config(permille, time_ms);
        let mut creep = Creep::default();
        let mut largest = 0_i64;
        for (reading, frames) in readings {
            largest = largest.max(reading.into());
            for _ in 0..frames {
                creep.observe(true, Newtons::from_bits(reading), &config);
                let found = i64::from(creep.force().to_bits());
                prop_assert!(found >= 0 && found * (1_000 + i64::from(permille)) <= largest * i64::from(permille) + 1_300);
            }
        }
    }
}

/// A board that holds so much for a time, s; its true force and status.
fn hold(config: &Config, goal_mn: i32, seconds: f64) -> (f64, Bench) {
    let mut board = Bench::of(&Setup::default(), config);
    board.tare();
    board.command().goal = newtons(goal_mn);
    while board.time_s() < seconds {
        board.step();
    }
    (board.truth().force_n, board)
}

#[test]
fn what_is_held_grows_by_the_rate_and_no_more_than_that() {
    // This array does not creep: the loop presses harder by all that it takes for creep.
    let (force, board) = hold(&config(100, 500), 2_000, 4.0);
    assert!((2.19..2.21).contains(&force), "{force}");
    let status = board.status();
    assert_eq!((status.mode, status.fault), (Mode::Force, None));
    let [contact, creep]: [f64; 2] = [status.contact.force, status.creep].map(|force| force.0.to_num());
    assert!((contact - force).abs() < 0.01 && (contact - creep - 2.0).abs() < 0.01, "{contact} {creep}");
    let (force, _) = hold(&config(0, 500), 2_000, 4.0);
    assert!((1.99..2.01).contains(&force), "{force}");
}

#[test]
fn it_never_leads_beyond_the_largest_force() {
    let params = Params { creep_permille: 300, creep_time_ms: 50, force_max_mn: 3_000, ..images::CONFIRMED };
    let (force, board) = hold(&Config::shipped(&params).unwrap(), 3_000, 3.0);
    assert!((2.98..3.02).contains(&force), "{force}");
    assert_eq!(board.status().fault, None);
}

#[test]
fn over_force_is_judged_by_the_reading() {
    // 2.6 N are read; 2 N are taken for true.
    let params = Params {
        creep_permille: 300,
        creep_time_ms: 50,
        force_max_mn: 2_650,
        force_fault_mn: 2_700,
        ..images::CONFIRMED
    };
    let (_, mut board) = hold(&Config::shipped(&params).unwrap(), 2_000, 4.0);
    assert_eq!(board.status().fault, None);
    let travel = board.truth().travel_mm;
    board.place(travel + 0.2);
    for _ in 0..50 {
        board.step();
    }
    assert_eq!(board.status().fault, Some(Fault::OverForce));
}
