//! Tests of the gain schedule: the gain set that it selects in each frame, and the gains of each set.

use super::config;
use crate::common::*;
use fingertip::config::{Config, GAIN_SETS};
use fingertip::control::GainSchedule;

/// Number of the gain set that the schedule selects.
fn number(schedule: &GainSchedule, config: &Config) -> usize {
    let number =
        config.gain_sets.iter().position(|gains| gains == schedule.gains(config)).expect("one of the gain sets");
    assert_eq!(schedule.settled(), number > 0);
    number
}

/// Gain set after each of `frames` frames with a constant position error (`way`, raw bits).
fn run(schedule: &mut GainSchedule, way: i32, frames: u32, config: &Config) -> Vec<usize> {
    let mut note = |_| {
        schedule.note(Millimetres::from_bits(way), config);
        number(schedule, config)
    };
    (0..frames).map(&mut note).collect()
}

/// Schedule with the calmest gain set and a mean position error of 0.
fn calmest(config: &Config) -> GainSchedule {
    let mut schedule = GainSchedule::QUICK;
    run(&mut schedule, 0, 10 * config.settled_frames, config);
    assert_eq!(number(&schedule, config), GAIN_SETS - 1);
    schedule
}

#[test]
fn without_an_error_each_gain_set_lasts_twice_as_long_as_the_one_before() {
    let config = config();
    let mut schedule = GainSchedule::QUICK;
    for slower in 0..GAIN_SETS - 1 {
        let lasts = config.settled_frames << slower;
        assert_eq!(run(&mut schedule, 0, lasts, &config), vec![slower; lasts as usize]);
        assert_eq!(run(&mut schedule, 0, 1, &config), [slower + 1]);
    }
    assert_eq!(run(&mut schedule, 0, 1_000, &config), [GAIN_SETS - 1; 1_000], "no gain set is calmer");
}

/// The largest mean error of a set: two bands for the calmest, twice as much for each faster one. The mean is exact.
#[test]
fn a_gain_set_is_kept_up_to_its_largest_error() {
    let config = config();
    let band = config.settled_band.to_bits();
    for (at, longest) in [(3, 2 * band), (2, 4 * band), (1, 8 * band)] {
        // Starts with the calmest gain set and steps up to set `at`.
        let mut schedule = calmest(&config);
        run(&mut schedule, -longest / 2 - 1, 10 * config.settled_frames, &config);
        run(&mut schedule, -longest, 200, &config);
        assert_eq!(number(&schedule, &config), at, "{longest}");
        // The same error again, for longer than a change to a calmer set takes.
        assert_eq!(*run(&mut schedule, -longest, 1_000, &config).last().unwrap(), at);
        assert_eq!(*run(&mut schedule, -longest - 1, 200, &config).last().unwrap(), at - 1);
        // Rounded down, the mean stays up to 7 below a positive error.
        let mut schedule = calmest(&config);
        assert!(run(&mut schedule, longest, 1_000, &config).iter().all(|number| *number >= at));
        assert_eq!(*run(&mut schedule, longest + 8, 200, &config).last().unwrap(), at - 1);
    }
}

/// A mean of half of the largest error changes to the calmer gain set; a bit more does not.
#[test]
fn half_the_largest_error_is_calm() {
    let config = config();
    let band = config.settled_band.to_bits();
    for (at, calm) in [(0, 4 * band), (1, 2 * band), (2, band)] {
        for (way, next) in [(calm, at + 1), (calm + 1, at)] {
            let mut schedule = GainSchedule::QUICK;
            run(&mut schedule, i32::MAX, 100, &config);
            run(&mut schedule, calm + 1, 20 * config.settled_frames, &config);
            assert_eq!(number(&schedule, &config), at, "at {calm}");
            let last = *run(&mut schedule, way, 20 * config.settled_frames, &config).last().unwrap();
            assert_eq!(last, next, "{way} of {calm}");
        }
    }
}

#[test]
fn a_large_error_counts_soon_and_is_forgotten_soon() {
    let config = config();
    for way in [i32::MAX, i32::MIN] {
        let mut schedule = calmest(&config);
        // The mean moves by 1/8 of its distance to 16 bands: 2, 3.75, 5.3, 6.6, 7.8, 8.8 of them. Rounding leaves the
        // first one at its limit or just beyond it.
        let met = run(&mut schedule, way, 6, &config);
        assert_eq!(met[1..], [2, 1, 1, 1, 0]);
        run(&mut schedule, way, 1_000, &config);
        // Down to a quarter in 11 frames; calm from then on.
        let frames = run(&mut schedule, 0, 1_000, &config).iter().position(|number| *number == 1).unwrap() as u32;
        assert!((10..=11).contains(&(frames - config.settled_frames)), "{frames} frames");
    }
}

#[test]
fn an_error_in_between_restarts_the_calm() {
    let config = config();
    let mut schedule = GainSchedule::QUICK;
    run(&mut schedule, 0, config.settled_frames - 2, &config);
    // The third frame of 16 bands makes a mean of 5.3, which is again below 4 after three frames without an error.
    run(&mut schedule, i32::MAX, 3, &config);
    let lasts = 2 + config.settled_frames;
    assert_eq!(run(&mut schedule, 0, lasts, &config), vec![0; lasts as usize]);
    assert_eq!(run(&mut schedule, 0, 1, &config), [1]);
}

/// Checks that all gains of a set follow from this speed gain k_v.
fn is_made_for(speed_gain: f64, gain_set: usize, config: &Config) {
    let gains = &config.gain_sets[gain_set];
    let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
    let slope = speed_gain / 3.0;
    let half = 0.5 * 2.5 * speed_gain * frame_s;
    let beta = (1.0 - half) / (1.0 + half);
    let gap = 1.0 - beta;
    let [l1, l2, l3] = gains.observer.map(f64::from);
    for (name, found, expected) in [
        ("l1", l1 / 2_f64.powi(31), 1.0 - beta.powi(3)),
        ("l2", l2 / 65_536.0, 1.5 * gap * gap * (1.0 + beta) / frame_s),
        ("l3", l3, gap.powi(3) / (frame_s * frame_s)),
        ("k_v", f64::from(gains.speed_q18_per_s) / 262_144.0, speed_gain),
        ("1/2k", f64::from(gains.half_over_slope_q32) / 2_f64.powi(32), 0.5 / slope),
        ("1/2k^2", f64::from(gains.half_over_slope2_q40) / 2_f64.powi(40), 0.5 / (slope * slope)),
    ] {
        assert!((found / expected - 1.0).abs() < 1e-3, "{name} of gain set {gain_set}: {found}, {expected} expected");
    }
    assert_eq!(gains.slope_per_s, slope as i32, "gain set {gain_set}");
}

/// The speed gain of the fastest set is halved for each calmer one, down to 60 /s. It is limited by:
/// - the frame time T: at most 1 / (5 T). This limits a loop with a fine encoder.
/// - the voltage of one count q, at most three quarters of the maximum: 5.8 k_v^2 q = 0.75 g V_max. This limits a loop
///   with a coarse encoder.
/// - the speed of one count, at most 60 mm/s in an observer that is 2.5 times as fast as the speed loop. This limits a
///   motor that drives the tip almost directly.
#[test]
fn frame_time_and_encoder_set_the_gains() {
    let default = Params::DEFAULT;
    for (limit, params, least) in [
        (0, Params { encoder_counts_per_turn: 65_536, ..default }, 0.0),
        (1, Params { encoder_counts_per_turn: 16, ..default }, 120.0),
        (2, Params { reduction_mrad_per_mm: 150, ..default }, 480.0),
    ] {
        let config = allowed(params);
        let q_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
        let voltage_max = f64::from(config.voltage_max_q8_mm_per_s2) / 256.0;
        let by_frames = 0.2 * 2_f64.powi(37) / f64::from(config.frame_s_q37);
        let quickest = [by_frames, (0.75 * voltage_max / (5.8 * q_mm)).sqrt(), 60.0 / (2.5 * q_mm)];
        let limits = quickest.iter().all(|other| *other >= quickest[limit]);
        assert!(limits && quickest[limit] > least, "{quickest:?}");
        for gain_set in 0..config.gain_sets.len() {
            is_made_for((quickest[limit] / f64::from(1 << gain_set)).max(60.0), gain_set, &config);
        }
    }
}
