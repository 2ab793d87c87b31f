//! Presses on drawn tips: valid ones complete, and an object that moves, yields or vanishes ends them within limits.

use crate::{drawn, fingers_or, population, print_worst, rows};
use fingertip::measure::press::ROWS_MAX;
use fingertip::measure::{Ended, MeasureState, MeasureStatus, Task};
use fingertip::params::Params;
use fingertip::shipped::Config;
use fingertip::state::Fault;
use sim::cores;
use sim::effects::Named;
use sim::native::bench::Bench;
use sim::population::Finger;
use sim::setup::Setup;
use solve::record;

const TIPS: &str = include_str!("tips.toml");
/// The largest force of a press as a share of the largest goal.
const FORCE_SHARE: f64 = 1.05;

/// One press, with the true states during it.
struct Made {
    standing: MeasureStatus,
    fault: Option<Fault>,
    rows: u32,
    record: Vec<u8>,
    force_n: f64,
    depth_mm: f64,
    took_s: f64,
}

/// Presses, and calls `each` after every frame with the time since the request.
fn make(finger: &Finger, mut each: impl FnMut(&mut Bench<Named>, f64)) -> Made {
    let mut bench = Bench::<Named>::new(&finger.scene).expect("a world");
    bench.tare();
    bench.run(0.05);
    let begun_s = bench.time_s();
    let distance_mm = drawn_or(finger, "object.distance_mm", 50.0);
    let (mut force_n, mut depth_mm) = (0.0_f64, 0.0_f64);
    let standing = bench.measure(Task::Press, |bench| {
        let truth = bench.truth();
        force_n = force_n.max(truth.force_n);
        depth_mm = depth_mm.max(truth.travel_mm - distance_mm);
        each(bench, bench.time_s() - begun_s);
    });
    let took_s = bench.time_s() - begun_s;
    let record = bench.kept().to_vec();
    let rows = rows(&record, standing.ended as u8);
    Made { standing, fault: bench.status().fault, rows, record, force_n, depth_mm, took_s }
}

/// The tips, with 0, 1 or 2 dead taxels near the contact.
fn tips(count: usize, changes: &[(&str, &str)]) -> Vec<Finger> {
    let dead = ["dead = []", "dead = [[4, 5]]", "dead = [[5, 4], [2, 6]]"];
    let text = changes.iter().fold(TIPS.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    let populations = dead.map(|dead| population("tips.toml", &text.replace("dead = []", dead)));
    let tip = |number: usize| populations[number % dead.len()].finger(2, number);
    (0..count).map(|number| tip(number).unwrap_or_else(|errors| panic!("{errors}"))).collect()
}

fn told(finger: &Finger, made: &Made) -> String {
    let MeasureStatus { ended, value, .. } = made.standing;
    format!(
        "{ended:?} {value} {:?} after {:.2} s; {:.0} kPa, {:.2} N, {:.2} mm deep, {} rows",
        made.fault,
        made.took_s,
        drawn(finger, "modulus_kpa"),
        made.force_n,
        made.depth_mm,
        made.rows
    )
}

#[test]
fn valid_presses_complete() {
    complete(10);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_valid_presses_complete() {
    complete(fingers_or(30));
}

fn complete(count: usize) {
    let fingers = tips(count, &[]);
    let made = cores::map(0..fingers.len(), |number| make(&fingers[number], |_, _| {}));
    let all = |of: fn(&Made) -> f64| made.iter().enumerate().map(|(number, made)| (of(made), number)).collect();
    for (number, (finger, made)) in fingers.iter().zip(&made).enumerate() {
        println!("tip {number}: {}", told(finger, made));
    }
    let force_n = print_worst("force, N", all(|made| made.force_n));
    let rows = print_worst("rows", all(|made| made.rows.into()));
    print_worst("bytes", all(|made| made.record.len() as f64));
    print_worst("time, s", all(|made| made.took_s));
    let most_n = 1e-3 * f64::from(Params::DEFAULT.force_max_mn) * FORCE_SHARE;
    assert!(force_n < most_n && rows <= ROWS_MAX as f64, "{force_n} N, {rows} rows");
    for (number, made) in made.iter().enumerate() {
        assert!(made.standing.state == MeasureState::Done && made.fault.is_none(), "tip {number}");
    }
    solve_all(&fingers, &made);
}

/// The modulus of every press: most within two reported sigmas, and the errors not smaller than noise allows.
fn solve_all(fingers: &[Finger], made: &[Made]) {
    let (mut errors, mut within) = (Vec::new(), 0);
    for (number, (finger, made)) in fingers.iter().zip(made).enumerate() {
        // A press is read as its own finger is set: its encoder's counts are drawn.
        let params = finger.scene.params();
        let press = record::press(&made.record, &params).unwrap_or_else(|why| panic!("tip {number}: {why}"));
        let found = solve::modulus(&[press]).unwrap_or_else(|why| panic!("tip {number}: {why}"));
        let truth = drawn(finger, "modulus_kpa");
        errors.push((100.0 * (found.kpa / truth - 1.0).abs(), number));
        within += usize::from((found.kpa - truth).abs() <= 2.0 * found.sigma_kpa);
    }
    let worst = print_worst("error of the modulus, %", errors.clone());
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let median = errors[errors.len() / 2].0;
    println!("{within} of {} within two sigmas", made.len());
    assert!((0.1..4.0).contains(&median) && worst < 10.0 && 10 * within >= 9 * made.len());
}

/// Disturbance of a press, and the ends that are valid with it.
struct Trouble {
    name: &'static str,
    changes: &'static [(&'static str, &'static str)],
    happens: fn(&mut Bench<Named>, f64, f64),
    ends: &'static [Ended],
}

fn nothing(_: &mut Bench<Named>, _: f64, _: f64) {}

const TROUBLES: [Trouble; 7] = [
    Trouble {
        name: "no object",
        changes: &[("distance_mm = { uniform = [1, 8] }", "distance_mm = 50")],
        happens: nothing,
        ends: &[Ended::NoContact],
    },
    Trouble {
        name: "a soft object",
        changes: &[(
            "[effects.tilted_plane]",
            "[effects.object_stiffness]\nyield_mm_per_n = { log_uniform = [0.2, 2] }\n[effects.tilted_plane]",
        )],
        happens: nothing,
        ends: &[Ended::Complete, Ended::Stalled],
    },
    Trouble {
        name: "an object that breaks",
        changes: &[(
            "[effects.tilted_plane]",
            "[effects.breakable_object]\nforce_n = { log_uniform = [0.1, 3] }\n[effects.tilted_plane]",
        )],
        happens: nothing,
        ends: &[Ended::Complete, Ended::Stalled],
    },
    Trouble {
        name: "an object that vanishes",
        changes: &[],
        happens: |bench, distance_mm, time_s| {
            if time_s > 1.0 + 0.2 * distance_mm {
                bench.place_object(1e3);
            }
        },
        ends: &[Ended::Complete, Ended::Touched, Ended::Stalled],
    },
    Trouble {
        name: "an object that comes 1 mm nearer at 20 mm/s",
        changes: &[],
        happens: |bench, distance_mm, time_s| {
            bench.place_object(distance_mm - (20.0 * (time_s - 1.2)).clamp(0.0, 1.0));
        },
        ends: &[Ended::Complete, Ended::Touched, Ended::Stalled],
    },
    Trouble {
        name: "an object that goes 2 mm away at 20 mm/s",
        changes: &[],
        happens: |bench, distance_mm, time_s| {
            bench.place_object(distance_mm + (20.0 * (time_s - 1.2)).clamp(0.0, 2.0));
        },
        ends: &[Ended::Complete, Ended::Touched, Ended::Stalled],
    },
    Trouble {
        name: "an object that comes past the tip's rest at 20 mm/s while the tip seeks it",
        changes: &[],
        happens: |bench, distance_mm, time_s| {
            bench.place_object((distance_mm - 20.0 * time_s).max(-0.5));
        },
        ends: &[Ended::Complete, Ended::Touched, Ended::Stalled],
    },
];

#[test]
fn what_moves_yields_or_vanishes_ends_a_press_within_its_limits() {
    end_within_limits(3);
}

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_what_moves_yields_or_vanishes_ends_a_press_within_its_limits() {
    end_within_limits(fingers_or(12));
}

fn end_within_limits(count: usize) {
    let mut broken = Vec::new();
    for Trouble { name, changes, happens, ends } in TROUBLES {
        let fingers = tips(count, changes);
        let made = cores::map(0..fingers.len(), |number| {
            let finger = &fingers[number];
            let distance_mm = drawn_or(finger, "object.distance_mm", 50.0);
            make(finger, |bench, time_s| happens(bench, distance_mm, time_s))
        });
        println!("{name}:");
        let mut valid = true;
        for (number, (finger, made)) in fingers.iter().zip(&made).enumerate() {
            println!("  tip {number}: {}", told(finger, made));
            valid &= made.force_n < 9.0 && made.rows <= ROWS_MAX as u32;
            valid &= ends.contains(&made.standing.ended) || made.fault.is_some();
        }
        broken.extend((!valid).then_some(name));
    }
    assert!(broken.is_empty(), "{broken:?}");
}

fn drawn_or(finger: &Finger, name: &str, otherwise: f64) -> f64 {
    let found = finger.drawn.iter().find(|(known, _)| known == name);
    found.and_then(|(_, value)| value.number()).unwrap_or(otherwise)
}

/// An end stop before the object: the motor is driven against it for at most 1 s.
#[test]
fn a_stuck_finger_ends_a_press() {
    let config = Config::shipped(&images::CONFIRMED).expect("the defaults are allowed");
    for front_mm in [0.5, 4.0, 5.2] {
        let mut bench = Bench::of(&Setup::default(), &config);
        bench.harm(|faults| faults.end_stops_mm = Some([-20.0, front_mm]));
        bench.tare();
        bench.run(0.05);
        let begun_s = bench.time_s();
        let standing = bench.measure(Task::Press, |_| {});
        let (fault, took_s) = (bench.status().fault, bench.time_s() - begun_s);
        println!("stop at {front_mm} mm: {:?} {} {fault:?} after {took_s:.2} s", standing.ended, standing.value);
        assert!(standing.ended == Ended::Stalled || fault.is_some());
        assert!(took_s < 2.5);
    }
}
