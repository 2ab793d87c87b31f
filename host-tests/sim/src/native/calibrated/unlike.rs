//! Errors of the force after calibration, of fingers that are far from their parameters (`populations/unlike.toml`).

use super::{Calibrated, Place, calibrate, changed, hold, plate, release};
use crate::cores;
use crate::effects::set::Named;
use crate::native::bench::Bench;
use crate::population::load;
use crate::run::RunError;
use fastrand::Rng;
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// Distance of the contact off the centre, mm.
const OFF_MM: f64 = 3.5;
/// Duration of a hold, s.
const HOLD_S: f64 = 1.5;
/// Pause before each touch, s.
const PAUSE_S: f64 = 10.0;
/// Tests: name, goal in N, whether it is off the centre.
const TESTS: [(&str, f64, bool); 3] =
    [("1 N", 1.0, false), ("5 N, centred", 5.0, false), ("5 N, off the centre", 5.0, true)];

/// One finger.
#[derive(Clone, Debug)]
pub struct Unlike {
    /// What calibration found.
    pub calibrated: Calibrated,
    /// Errors of the true force in the order of the tests, as shares of the goal: before and after calibration.
    pub errors: [[f64; 3]; 2],
}

/// Draws a finger, holds forces, calibrates it and holds them again.
pub fn finger(seed: u64, number: usize) -> Result<Unlike, RunError> {
    let drawn = load("unlike")?.finger(seed, number)?;
    let mut rng = Rng::with_seed(seed ^ (number as u64) << 32);
    let mut taxels: Vec<[usize; 2]> = (0..36).map(|taxel| [2 + taxel / 6, 2 + taxel % 6]).collect();
    rng.shuffle(&mut taxels);
    taxels.truncate(rng.usize(1..=3));
    let angle = TAU * rng.f64();
    let off = Place { centre_mm: [OFF_MM * angle.cos(), OFF_MM * angle.sin()], ..Place::default() };
    let scene = changed(&drawn.scene, &[("effects.broken_taxels.dead", format!("{taxels:?}"))])?;
    let mut bench = Bench::<Named>::new(&scene)?;
    let errors = |bench: &mut Bench<Named>| -> Result<[f64; 3], RunError> {
        let mut errors = [0.0; 3];
        for (error, (_, goal_n, is_off)) in errors.iter_mut().zip(TESTS) {
            bench.exchange(&plate(&scene, if is_off { off } else { Place::default() })?)?;
            bench.tare();
            *error = hold(bench, goal_n, HOLD_S).true_n / goal_n - 1.0;
            release(bench);
            bench.rest(PAUSE_S);
        }
        Ok(errors)
    };
    let before = errors(&mut bench)?;
    let calibrated = calibrate(&mut bench, &scene)?;
    let after = errors(&mut bench)?;
    Ok(Unlike { calibrated, errors: [before, after] })
}

/// Median and 95th percentile of the absolute errors of each test in percent: before and after calibration.
pub fn percentiles(fingers: &[Unlike]) -> [[[f64; 2]; 3]; 2] {
    [0, 1].map(|when| {
        [0, 1, 2].map(|test| {
            let mut all: Vec<f64> = fingers.iter().map(|finger| 100.0 * finger.errors[when][test].abs()).collect();
            all.sort_by(f64::total_cmp);
            [0.5, 0.95].map(|share| all[((all.len() - 1) as f64 * share).round() as usize])
        })
    })
}

/// Runs fingers on all cores.
pub fn fingers(seed: u64, count: usize) -> Result<Vec<Unlike>, RunError> {
    cores::map(0..count, |number| finger(seed, number).map_err(|error| error.to_string()))
        .into_iter()
        .map(|finger| Ok(finger?))
        .collect()
}

/// The errors as a text: worst fingers first, then percentiles.
pub fn text(fingers: &[Unlike]) -> String {
    let mut text = String::new();
    let worst = |finger: &Unlike| finger.errors[1].iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
    let mut order: Vec<usize> = (0..fingers.len()).collect();
    order.sort_by(|a, b| worst(&fingers[*b]).total_cmp(&worst(&fingers[*a])));
    for number in order {
        let [before, after] = fingers[number].errors.map(|errors| errors.map(|error| format!("{:+.1}", 100.0 * error)));
        let refused = fingers[number].calibrated.refused.join("; ");
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "finger {}: {} % before, {} % after  {refused}",
            number + 1,
            before.join(", "),
            after.join(", ")
        );
    }
    let [before, after] = percentiles(fingers);
    for ((name, ..), (before, after)) in TESTS.into_iter().zip(before.into_iter().zip(after)) {
        let _ = writeln!(
            text,
            "{name}: error of the true force, median {:.1} % and 95 % at {:.1} % before, {:.1} % and {:.1} % after",
            before[0], before[1], after[0], after[1]
        );
    }
    text
}
