//! When the loop is quicker, and when it is calmer, frame by frame.

use crate::config;
use fingertip::config::Config;
use fingertip::config::GAIN_SETS;
use fingertip::control::GainSchedule;
use fingertip::params::Params;
use fingertip::shipped;
use fingertip::units::Millimetres;

/// The pace's number, by the gains that it gives.
fn number(pace: &GainSchedule, config: &Config) -> usize {
    let number = config.gain_sets.iter().position(|gains| gains == pace.gains(config)).expect("one of the paces");
    assert_eq!(pace.calm(), number > 0);
    number
}

/// Gain set after each of `frames` frames with a distance of `way` bits.
fn run(pace: &mut GainSchedule, way: i32, frames: u32, config: &Config) -> Vec<usize> {
    let mut note = |_| {
        pace.note(Millimetres::from_bits(way), config);
        number(pace, config)
    };
    (0..frames).map(&mut note).collect()
}

/// At the calmest pace, with a mean way of 0.
fn calmest(config: &Config) -> GainSchedule {
    let mut pace = GainSchedule::QUICK;
    run(&mut pace, 0, 10 * config.calm_frames, config);
    assert_eq!(number(&pace, config), GAIN_SETS - 1);
    pace
}

#[test]
fn without_a_way_each_pace_lasts_twice_as_long_as_the_one_before() {
    let config = config();
    let mut pace = GainSchedule::QUICK;
    for slower in 0..GAIN_SETS - 1 {
        let lasts = config.calm_frames << slower;
        assert_eq!(run(&mut pace, 0, lasts, &config), vec![slower; lasts as usize]);
        assert_eq!(run(&mut pace, 0, 1, &config), [slower + 1]);
    }
    assert_eq!(run(&mut pace, 0, 1_000, &config), [GAIN_SETS - 1; 1_000], "no gain set is calmer");
}

/// Two bands at the calmest pace, twice that at each quicker one. A mean that comes down to its way meets it to the
/// last bit.
#[test]
fn a_pace_is_kept_up_to_its_longest_way_and_no_farther() {
    let config = config();
    let band = config.calm_band.to_bits();
    for (at, longest) in [(3, 2 * band), (2, 4 * band), (1, 8 * band)] {
        // From the calmest pace, quicker as far as the one looked at.
        let mut pace = calmest(&config);
        run(&mut pace, -longest / 2 - 1, 10 * config.calm_frames, &config);
        run(&mut pace, -longest, 200, &config);
        assert_eq!(number(&pace, &config), at, "{longest}");
        // Once more, as long as it takes to be calm.
        assert_eq!(*run(&mut pace, -longest, 1_000, &config).last().unwrap(), at);
        assert_eq!(*run(&mut pace, -longest - 1, 200, &config).last().unwrap(), at - 1);
        // Rounded down, the mean stays up to 7 below a positive way.
        let mut pace = calmest(&config);
        assert!(run(&mut pace, longest, 1_000, &config).iter().all(|number| *number >= at));
        assert_eq!(*run(&mut pace, longest + 8, 200, &config).last().unwrap(), at - 1);
    }
}

/// Half of its longest way lets a pace be left for the next, a bit more does not.
#[test]
fn half_as_long_a_way_is_calm() {
    let config = config();
    let band = config.calm_band.to_bits();
    for (at, calm) in [(0, 4 * band), (1, 2 * band), (2, band)] {
        for (way, next) in [(calm, at + 1), (calm + 1, at)] {
            let mut pace = GainSchedule::QUICK;
            run(&mut pace, i32::MAX, 100, &config);
            run(&mut pace, calm + 1, 20 * config.calm_frames, &config);
            assert_eq!(number(&pace, &config), at, "at {calm}");
            assert_eq!(*run(&mut pace, way, 20 * config.calm_frames, &config).last().unwrap(), next, "{way} of {calm}");
        }
    }
}

#[test]
fn a_long_way_is_soon_met_and_soon_forgotten() {
    let config = config();
    for way in [i32::MAX, i32::MIN] {
        let mut pace = calmest(&config);
        // The mean goes 1/8 of the way to 16 bands: 2, 3.75, 5.3, 6.6, 7.8, 8.8 of them. Rounding leaves the first one
        // at its limit or just beyond it.
        let met = run(&mut pace, way, 6, &config);
        assert_eq!(met[1..], [2, 1, 1, 1, 0]);
        run(&mut pace, way, 1_000, &config);
        // Down to a quarter in 11 frames; calm from then on.
        let frames = run(&mut pace, 0, 1_000, &config).iter().position(|number| *number == 1).unwrap() as u32;
        assert!((10..=11).contains(&(frames - config.calm_frames)), "{frames} frames");
    }
}

#[test]
fn a_way_in_between_makes_the_calm_begin_anew() {
    let config = config();
    let mut pace = GainSchedule::QUICK;
    run(&mut pace, 0, config.calm_frames - 2, &config);
    // The third frame of 16 bands makes a mean of 5.3, which is again below 4 after three without a way.
    run(&mut pace, i32::MAX, 3, &config);
    let lasts = 2 + config.calm_frames;
    assert_eq!(run(&mut pace, 0, lasts, &config), vec![0; lasts as usize]);
    assert_eq!(run(&mut pace, 0, 1, &config), [1]);
}

/// Checks that all gains of a pace follow from this speed gain k_v.
fn is_made_for(speed_gain: f64, pace: usize, config: &Config) {
    let gains = &config.gain_sets[pace];
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
        assert!((found / expected - 1.0).abs() < 1e-3, "{name} of pace {pace}: {found}, {expected} expected");
    }
    assert_eq!(gains.slope_per_s, slope as i32, "pace {pace}");
}

/// 1 / (5 T) where the encoder is fine, half of it at each calmer pace.
#[test]
fn a_fine_encoder_leaves_the_pace_to_the_time() {
    let config =
        shipped::Config::shipped(&Params { encoder_counts_per_turn: 65_536, ..Params::DEFAULT }).expect("allowed");
    let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
    for pace in 0..config.gain_sets.len() {
        is_made_for(0.2 / frame_s / f64::from(1 << pace), pace, &config);
    }
}

/// A count moves the voltage by three quarters of the largest at most: 5.8 k_v^2 q = 0.75 g V_max; no pace is slower
/// than 60 /s.
#[test]
fn a_coarse_encoder_makes_a_slower_loop() {
    let config = shipped::Config::shipped(&Params { encoder_counts_per_turn: 16, ..Params::DEFAULT }).expect("allowed");
    let q_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
    let quickest = (0.75 * f64::from(config.voltage_limit) / 256.0 / (5.8 * q_mm)).sqrt();
    let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
    assert!((120.0..0.2 / frame_s).contains(&quickest), "{quickest} /s");
    let mut at_the_least = 0;
    for pace in 0..config.gain_sets.len() {
        let speed_gain = quickest / f64::from(1 << pace);
        at_the_least += usize::from(speed_gain < 60.0);
        is_made_for(speed_gain.max(60.0), pace, &config);
    }
    assert!(at_the_least < config.gain_sets.len() - 1, "{quickest} /s");
}

/// Nor is a count taken for more than 60 mm/s by an observer 2.5 times as quick: where the motor drives the tip almost
/// directly.
#[test]
fn a_count_is_no_more_than_so_fast() {
    let config = shipped::Config::shipped(&Params { reduction_mrad_per_mm: 150, ..Params::DEFAULT }).expect("allowed");
    let q_mm = config.mm_per_count_q40 as f64 / 2_f64.powi(40);
    let quickest = 60.0 / (2.5 * q_mm);
    let frame_s = f64::from(config.frame_s_q37) / 2_f64.powi(37);
    assert!((480.0..0.2 / frame_s).contains(&quickest), "{quickest} /s");
    for pace in 0..config.gain_sets.len() {
        is_made_for(quickest / f64::from(1 << pace), pace, &config);
    }
}
