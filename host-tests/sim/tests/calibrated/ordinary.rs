//! Ordinary fingers, calibrated by the device's own procedures first: true force against the goal, beside the same
//! fingers as they come.

use sim::native::calibrated::Calibrated;
use sim::native::{self, simulate_calibrated};
use sim::population;
use sim::run::{Outcome, run};
use sim::scene::{Scene, controller};
use sim::watch::Watch;

/// Of each hold: what the true force is off, and what may be: 3 % and 20 mN, and 8 % and 50 mN; as shares of these.
fn errors(outcome: &Outcome) -> Vec<[f64; 2]> {
    let held = outcome.holds.iter().filter(|hold| !hold.missed && !hold.faulty);
    held.map(|hold| {
        let off_n = (hold.mean_n - hold.goal_n).abs();
        [off_n / (0.03 * hold.goal_n + 0.02), off_n / (0.08 * hold.goal_n + 0.05)]
    })
    .collect()
}

fn percentile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

fn told(name: &str, errors: &[[f64; 2]]) -> [f64; 2] {
    let mut sorted = [0, 1].map(|way| errors.iter().map(|error| error[way]).collect::<Vec<_>>());
    sorted.iter_mut().for_each(|values| values.sort_by(f64::total_cmp));
    let [median, most] = [percentile(&sorted[0], 0.5), percentile(&sorted[1], 0.95)];
    println!(
        "{name}: {} holds, median {median:.2} of 3 % + 20 mN, 95 % at {most:.2} and worst {:.2} of 8 % + 50 mN",
        errors.len(),
        percentile(&sorted[1], 1.0)
    );
    [median, most]
}

#[test]
fn ordinary_fingers_hold_closer_once_they_are_calibrated() {
    let ordinary = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let number = |name, usually| std::env::var(name).map_or(usually, |count| count.parse().expect("a number"));
    let (first, count) = (number("FIRST", 0), number("FINGERS", 10));
    let mut broken = Vec::new();
    for number in first..first + count {
        let scene = ordinary.finger(7, number).unwrap_or_else(|errors| panic!("{errors}")).scene;
        let calibrated = Calibrated::of(&scene).unwrap_or_else(|error| panic!("{error}"));
        let (own, params, gains) = (controller::params(&scene), calibrated.params, calibrated.gains);
        let with = calibrated.scene(&scene).expect("a scene");
        let board = |scene: &Scene, watch: &mut dyn Watch| Ok(simulate_calibrated(scene, &gains, watch)?);
        let as_it_comes = run(&scene, &native::board, &mut []).expect("it runs");
        let after_it = run(&with, &board, &mut []).expect("it runs");
        let worst = |outcome: &Outcome| errors(outcome).iter().map(|error| error[1]).fold(0.0, f64::max);
        println!(
            "finger {number}: modulus {} to {}, codes {} to {}: {:.2} to {:.2} {:?}",
            own.modulus_pa,
            params.modulus_pa,
            own.codes_per_kpa_milli,
            params.codes_per_kpa_milli,
            worst(&as_it_comes),
            worst(&after_it),
            calibrated.refused
        );
        if !after_it.passed() {
            broken.push((
                number,
                after_it.verdicts.iter().filter(|verdict| !verdict.held).cloned().collect::<Vec<_>>(),
                as_it_comes.passed(),
            ));
        }
        before.extend(errors(&as_it_comes));
        after.extend(errors(&after_it));
    }
    told("as they come", &before);
    let [median, most] = told("calibrated", &after);
    println!("{broken:#?}");
    assert!(broken.is_empty());
    assert!(median < 1.0 && most < 1.0, "{median} {most}");
}
