//! Fingers that are far from their parameters, calibrated by the host.

use sim::native::calibrated::unlike::{fingers, percentiles, text};
use sim::run::{Run, run};
use sim::{native, population};

/// `population unlike --fingers 40` prints the figures of more fingers.
#[test]
fn calibration_leaves_a_few_percent_of_the_force() {
    let fingers = fingers(1, 4).unwrap_or_else(|error| panic!("{error}"));
    println!("{}", text(&fingers));
    let [before, after] = percentiles(&fingers);
    for (test, most) in [9.0, 8.0, 12.0].into_iter().enumerate() {
        assert!(after[test][1] < most && after[test][0] < before[test][0], "{before:?} {after:?}");
    }
    // Fingers that cannot be calibrated would keep their errors.
    assert!(fingers.iter().all(|finger| finger.calibrated.refused.is_empty()));
}

/// Ordinary fingers as they come, and calibrated first: what a hold is off, as shares of 3 % and 20 mN, and of 8 % and
/// 50 mN. More with `FINGERS=20 cargo test -p sim --profile host --test unlike ordinary -- --nocapture`.
#[test]
fn ordinary_fingers_hold_closer_once_they_are_calibrated() {
    let count = std::env::var("FINGERS").map_or(4, |count| count.parse().expect("a number"));
    let ordinary = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
    let shares = |board: Run<'_>| {
        let scenes =
            (0..count).map(|number| ordinary.finger(7, number).unwrap_or_else(|errors| panic!("{errors}")).scene);
        let outcomes = scenes.map(|scene| run(&scene, board, &mut []).expect("it runs"));
        let held = outcomes.flat_map(|outcome| outcome.holds).filter(|hold| !hold.missed && !hold.faulty);
        let off: Vec<[f64; 2]> = held.map(|hold| [(hold.mean_n - hold.goal_n).abs(), hold.goal_n]).collect();
        let shares = |part: f64, more_n: f64| {
            let mut shares: Vec<f64> = off.iter().map(|[off_n, goal_n]| off_n / (part * goal_n + more_n)).collect();
            shares.sort_by(f64::total_cmp);
            shares
        };
        let [usual, most] = [shares(0.03, 0.02), shares(0.08, 0.05)];
        [usual[usual.len() / 2], most[(most.len() - 1) * 19 / 20], most[most.len() - 1]]
    };
    let [before, after] = [shares(&native::board), shares(&native::calibrated::board)];
    println!("median, 95 % and worst: {before:.2?} as they come, {after:.2?} calibrated");
    assert!(after[0] < 0.5 && after[1] < 0.8 && after[2] < 1.0 && after[0] < before[0], "{before:?} {after:?}");
}
