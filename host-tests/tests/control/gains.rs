//! The gains of each pace against the formulas that give them.

use fingertip::config::Config;
use fingertip::params::Params;
use fingertip::shipped;

/// Of a pace: k_v, and all gains by it.
fn is_made_for(speed_gain: f64, pace: usize, config: &Config) {
    let gains = &config.paces[pace];
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
    for pace in 0..config.paces.len() {
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
    for pace in 0..config.paces.len() {
        let speed_gain = quickest / f64::from(1 << pace);
        at_the_least += usize::from(speed_gain < 60.0);
        is_made_for(speed_gain.max(60.0), pace, &config);
    }
    assert!(at_the_least < config.paces.len() - 1, "{quickest} /s");
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
    for pace in 0..config.paces.len() {
        is_made_for(quickest / f64::from(1 << pace), pace, &config);
    }
}
