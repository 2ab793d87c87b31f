//! The drive solved from the strokes that the core makes and records, on drawn drives: what is found, how true it is, and what
//! never happens.

use crate::*;
use fingertip::measure::Task;
use sim::native::bench::Bench;
use sim::population::read;
use sim::scene::Scene;
use solve::record;
use solve::strokes::{Record, solve};

/// Drives as they come. Friction falls with speed.
const DRIVES: &str = include_str!("../../../host-tests/sim/tests/fingers/drives.toml");
/// Recorded strokes: all, and the slow ones alone.
const ALL: usize = 32;
const SLOW: usize = 8;

const QUANTITIES: [&str; 5] = ["k", "tau", "inertia", "friction forward", "friction back"];

/// Prints the worst of values that belong to drives, and the median; returns the worst.
fn tell(name: &str, values: &[(f64, usize)]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some((worst, number)) = values.first() else { return 0.0 };
    println!("{name}: worst {worst:.2} (drive {number}), median {:.2}", values[values.len() / 2].0);
    *worst
}

/// Standard uncertainties up to which k and tau count as measured.
const MEASURED: [f64; 2] = [0.025, 0.05];

/// Replacement for a drive by which it has the finest encoder.
const FINE: (&str, &str) = ("counts_per_turn = { log_uniform = [256, 4096] }", "counts_per_turn = 4096");

/// A drive of the population, some of whose lines are replaced.
fn drive(number: usize, changes: &[(&str, &str)]) -> Scene {
    let text = changes.iter().fold(DRIVES.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    let population = read("drives.toml", &text).unwrap_or_else(|errors| panic!("{errors}"));
    population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}")).scene
}

/// Friction torque at high speed, N m.
fn friction_nm(scene: &Scene) -> f64 {
    let friction = scene.effects.iter().find(|effect| effect.effect.name == "dry_friction").expect("it is drawn");
    1e-3 * friction.values.number("torque_mnm")
}

/// The core's strokes of a drive and the record that it keeps of them. Before each stroke `next` may exchange the drive.
fn measure(scene: &Scene, mut next: impl FnMut() -> Option<Scene>) -> Record {
    let mut bench = Bench::new(scene).expect("a finger");
    bench.tare();
    bench.command().torque = false;
    let mut drove = false;
    bench.measure(Task::Strokes, |bench| {
        let drives = bench.status().duty.0 != 0;
        if drives && !drove {
            next().iter().for_each(|scene| bench.exchange(scene).expect("a finger"));
        }
        drove = drives;
    });
    record::strokes(bench.kept(), &scene.params()).expect("strokes")
}

/// Solves drives by their records and judges the results by the bounds that hold for every population in the air. At least
/// `least` of the drives must be measured.
fn judge(name: &str, drives: impl Iterator<Item = (Scene, Record)>, least: usize) {
    // Errors of each quantity, in percent, and drives with an error beyond 5 % and two standard uncertainties.
    let (mut errors, mut silent) = (QUANTITIES.map(|_| Vec::new()), Vec::new());
    let (mut refused, mut measured) = (Vec::new(), 0);
    for (number, (scene, record)) in drives.enumerate() {
        let found = match solve(&record) {
            Ok(found) => found,
            Err(refusal) => {
                println!("drive {number}: {refusal}");
                refused.push(number);
                continue;
            }
        };
        let setup = scene.setup();
        let (k, ohm) = (setup.motor.torque_nm_per_a, setup.motor.resistance_ohm + setup.supply.bridge_ohm);
        // With what the gear and the finger add.
        let m_per_rad = 1e-3 * setup.transmission.drum_radius_mm / setup.transmission.ratio;
        let inertia = setup.motor.inertia_kg_m2 + 0.05e-7 + 0.03 * m_per_rad.powi(2);
        let pairs = [
            (found.torque_constant, k),
            (found.time_constant_s, ohm * inertia / (k * k)),
            (found.inertia_kg_m2, inertia),
            (found.friction_nm[0], friction_nm(&scene)),
            (found.friction_nm[1], friction_nm(&scene)),
        ];
        for (place, (found, truth)) in pairs.into_iter().enumerate() {
            let error = (found.value / truth - 1.0).abs();
            errors[place].push((100.0 * error, number));
            if place < 2 && error > 0.05 && found.relative() < 0.5 * error {
                silent.push(number);
            }
        }
        measured += usize::from(pairs.iter().zip(MEASURED).all(|((found, _), most)| found.relative() < most));
    }
    println!("{name}: {measured} measured, refused {refused:?}, silently wrong {silent:?}");
    let [worst, ..] =
        core::array::from_fn::<_, 5, _>(|place| tell(&format!("{} %", QUANTITIES[place]), &errors[place]));
    assert!(silent.is_empty() && measured >= least, "{measured} measured");
    // By encoders of 256 to 4096 counts, k cannot be exact for every drive of a population.
    assert!(least < 8 || (0.1..5.0).contains(&worst), "{worst}");
}

/// Drives of the population with the first strokes of their records.
fn measured(numbers: Range<usize>, strokes: usize) -> impl Iterator<Item = (Scene, Record)> {
    numbers.map(move |number| {
        let scene = drive(number, &[]);
        let mut record = measure(&scene, || None);
        record.strokes.truncate(strokes);
        (scene, record)
    })
}

sim::sizes!(
    drives_as_they_come_are_measured,
    judge("as they come", measured(0..12, ALL), 11),
    judge("as they come", measured(12..60, ALL), 43)
);

// Slow strokes alone do not separate k from friction that falls with speed. The uncertainties must cover that.
sim::sizes!(
    slow_strokes_alone_say_how_little_they_tell,
    judge("slow", measured(0..1, SLOW), 0),
    judge("slow", measured(1..4, SLOW), 0)
);

// Friction that changes from stroke to stroke, and torque that changes along the travel, are not in the model.
sim::sizes!(friction_that_is_not_even_is_not_silently_wrong, uneven(0..4), uneven(4..8));

fn uneven(numbers: Range<usize>) {
    let drives = numbers.map(|number| {
        let cogs = "[effects.cogging]\ntorque_mnm = { is = \"0.05 * friction_mnm\" }\nteeth = 3\n[motor]\n";
        let along = ("[motor]\n", if number % 2 == 0 { cogs } else { "[motor]\n" });
        let (scene, mut rng) = (drive(number, &[along]), fastrand::Rng::with_seed(number as u64));
        let other = || {
            let share = 0.01 * (1.0 + 0.05 * (2.0 * rng.f64() - 1.0));
            Some(drive(number, &[along, ("0.01 * friction_percent", &format!("{share} * friction_percent"))]))
        };
        let record = measure(&scene, other);
        (scene, record)
    });
    judge("uneven", drives, 2);
}

/// Motors that are nothing like the reference, known as far as their sheets go, and one that is far from its sheet.
#[test]
fn other_motors_are_measured_too() {
    const K: &str = "torque_mnm_per_a = { uniform = [4.6, 6.1] }";
    const OHM: &str = "winding_ohm = { uniform = [2.4, 3.3] }";
    const INERTIA: &str = "inertia_g_cm2 = { uniform = [0.6, 0.82] }";
    const SHEET_K: &str = "torque_constant_unm_per_a = 5350";
    const SHEET_INERTIA: &str = "inertia_ug_m2 = 71";
    const GEAR: &str = "[motor]\n";
    let motors: [&[(&str, &str)]; 3] = [
        // Without a gear on a short crank; a small quick one with a high gear; three times the inertia of the sheet.
        &[
            (K, "torque_mnm_per_a = { uniform = [15.9, 16.1] }"),
            (OHM, "winding_ohm = { uniform = [7.9, 8.1] }"),
            (INERTIA, "inertia_g_cm2 = 8.0"),
            FINE,
            (SHEET_K, "torque_constant_unm_per_a = 16000"),
            (SHEET_INERTIA, "inertia_ug_m2 = 800"),
            (GEAR, "[transmission]\nratio = 1\ndrum_radius_mm = 1.2\n[motor]\n"),
        ],
        &[
            (K, "torque_mnm_per_a = { uniform = [3.19, 3.21] }"),
            (OHM, "winding_ohm = { uniform = [8.9, 9.1] }"),
            (INERTIA, "inertia_g_cm2 = 0.1"),
            (SHEET_K, "torque_constant_unm_per_a = 3200"),
            (SHEET_INERTIA, "inertia_ug_m2 = 10"),
            (GEAR, "[transmission]\nratio = 150\ndrum_radius_mm = 8\n[motor]\n"),
        ],
        &[(INERTIA, "inertia_g_cm2 = 2.1")],
    ];
    let drives = motors.iter().map(|changes| drive(0, changes));
    judge("other", drives.map(|scene| (scene.clone(), measure(&scene, || None))), 2);
}

#[test]
fn a_refusal_states_its_reason_and_the_number_behind_it() {
    let record = measure(&drive(0, &[FINE]), || None);
    let refused = |record: &Record| solve(record).expect_err("nothing to solve");
    let changed = |change: fn(i32) -> i32| {
        let mut record = record.clone();
        let samples = record.strokes.iter_mut().flat_map(|stroke| &mut stroke.samples);
        samples.for_each(|sample| sample.count = change(sample.count));
        record
    };
    let counts = 1.4 * record.rad_per_mm / core::f64::consts::TAU * record.counts_per_turn;
    let NoDrive::Reversed(found) = refused(&changed(|count| -count)) else { panic!("not reversed") };
    assert!((f64::from(found) - counts).abs() < 0.1 * counts);
    assert_eq!(refused(&changed(|_| 7)), NoDrive::Still(0));
    assert!(matches!(refused(&changed(|count| if count > 60 { count + 50 } else { count })), NoDrive::Astray(_)));
    // A memory that was full before the motions ended: the strokes in it count, but for the last.
    let full = record::Ended { reason: Reason::Full, value: 5_000 };
    let cut = Record { strokes: record.strokes[..25].to_vec(), ended: Some(full), ..record.clone() };
    let whole = Record { strokes: record.strokes[..24].to_vec(), ..record.clone() };
    let found = solve(&cut);
    assert!(found.is_ok() && found == solve(&whole), "{found:?}");
    assert_eq!(refused(&Record { strokes: record.strokes[..4].to_vec(), ..record.clone() }), NoDrive::Few(2));
    let touched = record::Ended { reason: Reason::Touched, value: 50 };
    assert_eq!(refused(&Record { ended: Some(touched), ..record }), NoDrive::Ended(touched));
}

/// Strokes of the emulated board for which the cost of the fit is flat around its minimum. The fit once ran out of rounds.
#[test]
fn a_fit_with_nothing_left_to_gain_is_solved() {
    let strokes = record::strokes(include_bytes!("flat-valley.strokes"), &Params::DEFAULT).expect("strokes");
    let k = solve(&strokes).expect("a drive").torque_constant;
    assert!((k.value * 1e6 / f64::from(Params::DEFAULT.torque_constant_unm_per_a) - 1.0).abs() < 0.02, "{k:?}");
}
