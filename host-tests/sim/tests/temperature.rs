//! Error of a force that is held for an hour at high temperature, with right and wrong coefficients and proxy.

use sim::native;
use sim::run::run;

const GAIN: f64 = 3_600.0;
const ZERO: f64 = 10.0;

/// The largest error of the held force, mN, with coefficients that are so much of the true ones, and other keys.
fn error_mn(share: f64, keys: &[&str]) -> f64 {
    let coefficients = [
        format!("controller.array_gain_ppm_per_k={}", (GAIN * share).round()),
        format!("controller.array_zero_pa_per_k={}", (ZERO * share).round()),
    ];
    let keys: Vec<String> = coefficients.into_iter().chain(keys.iter().map(|key| (*key).into())).collect();
    let scene = sim::cli::load("hot_hour", &keys, None).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run(&scene, &native::board, &mut []).expect("it runs");
    assert_eq!(outcome.measured.get("faults_count"), Some(0.0));
    outcome.measured.get("steady_error_max_mn").expect("it is held")
}

#[test]
fn the_term_takes_most_of_an_hour_in_the_hot_away() {
    let drift = "effects.temperature_drift";
    // Shares of the coefficients and of the chip's warming, its time constant over the array's 1.5 s, the bound.
    let cases = [
        (0.0, 1.0, 1.5, 238.0..250.0),
        (1.0, 1.0, 1.5, 0.0..30.0),
        (0.8, 1.0, 1.5, 0.0..70.0),
        (1.2, 1.0, 1.5, 0.0..70.0),
        (1.0, 0.8, 1.5, 0.0..70.0),
        (1.0, 1.2, 1.5, 0.0..70.0),
        (1.0, 1.0, 0.75, 0.0..100.0),
        (1.0, 1.0, 3.0, 0.0..100.0),
    ];
    let mut beyond = Vec::new();
    for (share, chip, time_s, bounds) in cases {
        let keys = [format!("{drift}.chip_share={chip}"), format!("{drift}.chip_time_constant_s={time_s}")];
        let found = error_mn(share, &keys.each_ref().map(String::as_str));
        println!("coefficients {share}, proxy {chip}, {time_s} s: {found:.1} mN");
        if !bounds.contains(&found) {
            beyond.push((share, chip, time_s, found));
        }
    }
    assert!(beyond.is_empty(), "{beyond:?}");
}
