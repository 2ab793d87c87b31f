//! Measuring motions on drawn fingers: completion, early ends, and bounds of travel, force and time.

use crate::*;
use fingertip::measure::press::ROWS_MAX;
use fingertip::measure::series::HEAD;
use fingertip::measure::{Ended, MeasureState, MeasureStatus};
use sim::plant::Faults;
use sim::population::{Finger, read};
use sim::setup::Setup;
use solve::record;

/// A measuring motion, and the largest true values during it.
struct Made {
    status: MeasureStatus,
    fault: Option<Fault>,
    rows: u32,
    record: Vec<u8>,
    force_n: f64,
    /// From the place where it began.
    travel_mm: f64,
    took_s: f64,
}

/// Tares and makes a motion; calls `each` after every frame with the time since the request.
fn make(mut bench: Bench, task: Task, mut each: impl FnMut(&mut Bench, f64)) -> Made {
    bench.tare();
    if task == Task::Press {
        bench.run(0.05);
    } else {
        bench.command().torque = false;
    }
    let (begun_s, begun_mm) = (bench.time_s(), bench.truth().travel_mm);
    let (mut force_n, mut travel_mm) = (0.0_f64, 0.0_f64);
    let status = bench.measure(task, |bench| {
        let truth = bench.truth();
        force_n = force_n.max(truth.force_n);
        travel_mm = travel_mm.max((truth.travel_mm - begun_mm).abs());
        each(bench, bench.time_s() - begun_s);
    });
    let (record, mut rows) = (bench.kept().to_vec(), 0);
    // A jog keeps no record. The head of the others agrees with how the motion ended.
    if task != Task::Jog {
        assert!(record.len() >= HEAD && record.starts_with(b"FTS\x01"), "{} bytes", record.len());
        assert_eq!(record[7], status.ended as u8);
        rows = u32::from_le_bytes([record[8], record[9], record[10], record[11]]);
    }
    Made { status, fault: bench.status().fault, rows, record, force_n, travel_mm, took_s: bench.time_s() - begun_s }
}

fn largest(made: &[Made], of: fn(&Made) -> f64) -> f64 {
    made.iter().map(of).fold(0.0, f64::max)
}

fn fingers(text: &str, seed: u64, numbers: impl Iterator<Item = usize>) -> Vec<Finger> {
    let population = read("drawn.toml", text).unwrap_or_else(|errors| panic!("{errors}"));
    numbers.map(|number| population.finger(seed, number).unwrap_or_else(|errors| panic!("{errors}"))).collect()
}

/// Value drawn for a finger under this name, if there is one.
fn drawn(finger: &Finger, name: &str) -> Option<f64> {
    finger.drawn.iter().find(|(known, _)| known == name).and_then(|(_, value)| value.number())
}

/// The tips, with no, one and two dead taxels near the contact in turn.
fn tips(count: usize, changes: &[(&str, &str)]) -> Vec<Finger> {
    let text = replaced(include_str!("tips.toml"), changes);
    let dead = ["[]", "[[4, 5]]", "[[5, 4], [2, 6]]"].iter().enumerate();
    let tips = dead.flat_map(|(first, dead)| {
        fingers(&text.replace("dead = []", &format!("dead = {dead}")), 2, (first..count).step_by(3))
    });
    tips.collect()
}

/// Makes a motion with each finger. The object is put where `place_mm` has it, by its distance and the time, s.
fn make_all(fingers: &[Finger], task: Task, place_mm: Option<Place>) -> Vec<Made> {
    cores::map(fingers, |finger| {
        let distance_mm = drawn(finger, "object.distance_mm");
        make(Bench::new(&finger.scene).expect("a world"), task, |bench, time_s| {
            if let (Some(place_mm), Some(distance_mm)) = (place_mm, distance_mm) {
                bench.place_object(place_mm(distance_mm, time_s));
            }
        })
    })
}

sim::sizes!(valid_presses_complete, presses_complete(6), presses_complete(60));

/// Every press completes and gives a modulus: most within two reported sigmas, and with errors that are not smaller
/// than noise allows.
fn presses_complete(count: usize) {
    let fingers = tips(count, &[]);
    let made = make_all(&fingers, Task::Press, None);
    let most_n = 1e-3 * f64::from(Params::DEFAULT.force_max_mn) * 1.05;
    assert!(largest(&made, |made| made.force_n) < most_n);
    let (mut errors_percent, mut sigmas_percent, mut within) = (Vec::new(), Vec::new(), 0);
    for (number, (finger, made)) in fingers.iter().zip(&made).enumerate() {
        assert!(made.status.state == MeasureState::Done && made.fault.is_none(), "tip {number}");
        assert!(made.rows <= ROWS_MAX as u32, "tip {number}");
        // A press is read as its own finger is set: its encoder's counts are drawn.
        let press =
            record::press(&made.record, &finger.scene.params()).unwrap_or_else(|why| panic!("tip {number}: {why}"));
        let found = solve::modulus(&[press]).unwrap_or_else(|why| panic!("tip {number}: {why}"));
        let truth_kpa = drawn(finger, "modulus_kpa").expect("it is drawn");
        errors_percent.push(100.0 * (found.kpa / truth_kpa - 1.0).abs());
        sigmas_percent.push(100.0 * found.sigma_kpa / found.kpa);
        within += usize::from((found.kpa - truth_kpa).abs() <= 2.0 * found.sigma_kpa);
    }
    errors_percent.sort_by(f64::total_cmp);
    let (median, worst) = (errors_percent[count / 2], errors_percent[count - 1]);
    assert!((0.1..4.0).contains(&median) && worst < 10.0, "errors of {median:.2} %, {worst:.2} % at most");
    // A share of a few presses says little: 95 of 100 are expected.
    assert!(count < 60 || 10 * within >= 9 * count, "{within} of {count} within two sigmas");
    let rms = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let honest = rms(&sigmas_percent) / rms(&errors_percent);
    assert!((0.5..3.0).contains(&honest), "the uncertainty is {honest:.2} times the error");
}

/// Position of an object, mm, from its distance and the time, s.
type Place = fn(f64, f64) -> f64;

const VANISHES: Place = |distance_mm, time_s| if time_s > 1.0 + 0.2 * distance_mm { 1e3 } else { distance_mm };
/// At 20 mm/s from 1.2 s on: 1 mm nearer, or 2 mm away.
const NEARER: Place = |distance_mm, time_s| distance_mm - (20.0 * (time_s - 1.2)).clamp(0.0, 1.0);
const AWAY: Place = |distance_mm, time_s| distance_mm + (20.0 * (time_s - 1.2)).clamp(0.0, 2.0);
/// At 20 mm/s past the tip's rest, while the tip seeks it.
const PAST: Place = |distance_mm, time_s| (distance_mm - 20.0 * time_s).max(-0.5);

const SOFT: &str = "[effects.object_stiffness]\nyield_mm_per_n = { log_uniform = [0.2, 2] }\n[effects.noise]";
const BREAKS: &str = "[effects.breakable_object]\nforce_n = { log_uniform = [0.1, 3] }\n[effects.noise]";

/// Disturbance of a press: its name, changes of the tips, the place of the object, and the ends that are valid with it.
type Trouble = (&'static str, &'static [(&'static str, &'static str)], Option<Place>, &'static [Ended]);

/// Ends of a press whose object moves.
const MOVED: &[Ended] = &[Ended::Complete, Ended::Touched, Ended::Stalled];

const TROUBLES: [Trouble; 7] = [
    ("no object", &[("distance_mm = { uniform = [1, 8] }", "distance_mm = 50")], None, &[Ended::NoContact]),
    ("a soft object", &[("[effects.noise]", SOFT)], None, &[Ended::Complete, Ended::Stalled]),
    ("an object that breaks", &[("[effects.noise]", BREAKS)], None, &[Ended::Complete, Ended::Stalled]),
    ("an object that vanishes", &[], Some(VANISHES), MOVED),
    ("an object that comes nearer", &[], Some(NEARER), MOVED),
    ("an object that goes away", &[], Some(AWAY), MOVED),
    ("an object that comes past the tip's rest", &[], Some(PAST), MOVED),
];

sim::sizes!(what_moves_yields_or_vanishes_ends_a_press_within_its_limits, presses_end_within_limits: 1, 12);

fn presses_end_within_limits(count: usize) {
    let mut broken = Vec::new();
    for (name, changes, place_mm, ends) in TROUBLES {
        let made = make_all(&tips(count, changes), Task::Press, place_mm);
        let valid = |made: &Made| {
            let ended = ends.contains(&made.status.ended) || made.fault.is_some();
            ended && made.force_n < 9.0 && made.rows <= ROWS_MAX as u32
        };
        let told = |made: &Made| {
            let Made { status, fault, rows, force_n, .. } = made;
            format!("{name}: {status:?} {fault:?}, {force_n:.3} N, {rows} rows")
        };
        broken.extend(made.iter().filter(|made| !valid(made)).map(told));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// A press that begins on a contact backs off as far as a release, though the array still reads a residue. Where that ends
/// it, the goal is approached as from the air.
#[test]
fn a_press_that_begins_on_a_contact_stays_near_it() {
    let tips = tips(12, &[]);
    let (places, speeds): (Vec<_>, Vec<_>) = (cores::map(&tips, |tip| {
        let distance_mm = drawn(tip, "object.distance_mm").expect("it is drawn");
        let mut finger = begun(&tip.scene);
        press(&mut finger, 3.0, 1.0 + distance_mm / APPROACH_MM_PER_S);
        let held = finger.truth();
        let mut least_mm = f64::INFINITY;
        finger.request(Task::Press);
        finger.step();
        // The cycles begin at 10 %.
        while finger.status().measure.state == MeasureState::Running && finger.status().measure.progress < 10 {
            finger.step();
            least_mm = least_mm.min(finger.truth().travel_mm);
        }
        assert!(least_mm < held.travel_mm, "it backs off");
        let ended = finger.status().measure.ended;
        let what = format!("{:.2} N at {:.2} mm, {ended:?}", held.force_n, held.travel_mm);
        let clearance_mm = 1e-3 * f64::from(tip.scene.params().clearance_um);
        let place = Case::new(what.clone(), held.travel_mm - least_mm, held.indentation_mm + clearance_mm + 1.0);
        (place, Case::new(what, fastest_in_the_air(&mut finger, (0.0, 3.0), 0.5), 1.5 * APPROACH_MM_PER_S))
    }))
    .into_iter()
    .unzip();
    judge("a press that begins on a contact: backs off", "mm", &places);
    judge("a press that begins on a contact: speed in the air", "mm/s", &speeds);
}

/// Noise of 6 codes lifts single frames above the force of a contact: the press begins at the plate all the same.
#[test]
fn a_press_takes_no_peak_of_noise_for_the_touch() {
    let tips = tips(12, &[("rms_codes = { uniform = [0, 3] }", "rms_codes = 6")]);
    let cases = cores::map(&tips, |tip| {
        let distance_mm = drawn(tip, "object.distance_mm").expect("it is drawn");
        let mut finger = begun(&tip.scene);
        finger.run(0.05);
        finger.request(Task::Press);
        finger.step();
        // The cycles begin half a millimetre before the touch, at 10 %.
        while finger.status().measure.state == MeasureState::Running && finger.status().measure.progress < 10 {
            finger.step();
        }
        let truth = finger.truth();
        let what = format!("a plate at {distance_mm:.2} mm: {:?}", finger.status());
        assert_eq!(finger.status().measure.state, MeasureState::Running, "{what}");
        Case::new(what, (truth.travel_mm + 0.5 - distance_mm).abs(), 0.4)
    });
    judge("a noisy press begins at the plate", "mm", &cases);
}

/// The reference finger with a defect.
fn harmed(defect: impl FnOnce(&mut Faults)) -> Bench {
    let config = Config::shipped(&images::CONFIRMED).expect("the defaults are allowed");
    let mut bench = Bench::of(&Setup::default(), &config);
    bench.harm(defect);
    bench
}

/// An end stop before the object: the motor is driven against it for at most 1 s.
#[test]
fn a_stuck_finger_ends_a_press() {
    for front_mm in [0.5, 4.0, 5.2] {
        let made = make(harmed(|faults| faults.end_stops_mm = Some([-20.0, front_mm])), Task::Press, |_, _| {});
        assert!(made.status.ended == Ended::Stalled || made.fault.is_some(), "stop at {front_mm} mm");
        assert!(made.took_s < 2.5, "stop at {front_mm} mm: {} s", made.took_s);
    }
}

/// Limit of the strokes: distance from the origin.
const STROKES_MM: f64 = 1.6;

/// Strokes or jogs of drawn drives, within their limits of travel and force; what is solved from strokes is true, also
/// where something is in the way. Returns how many completed.
fn driven(name: &str, count: usize, task: Task, changes: &[(&str, &str)]) -> usize {
    let fingers = fingers(&replaced(include_str!("drives.toml"), changes), 1, 0..count);
    let made = make_all(&fingers, task, None);
    let mut solved = 0;
    for (finger, made) in fingers.iter().zip(&made).filter(|_| task == Task::Strokes) {
        let strokes = record::strokes(&made.record, &finger.scene.params()).expect("strokes");
        let Ok(solve::strokes::MeasuredDrive { torque_constant, .. }) = solve::strokes::solve(&strokes) else {
            continue;
        };
        solved += 1;
        let true_k = 1e-3 * drawn(finger, "torque_mnm_per_a").expect("it is drawn");
        assert!((torque_constant.value / true_k - 1.0).abs() < 0.05, "{name}: {torque_constant}, not {true_k}");
    }
    assert!(solved > 0 || task != Task::Strokes || !changes.is_empty(), "{name}");
    let [travel_mm, force_n] = [largest(&made, |made| made.travel_mm), largest(&made, |made| made.force_n)];
    assert!(travel_mm < STROKES_MM && force_n < 0.3, "{name}: {travel_mm} mm, {force_n} N");
    made.iter().filter(|made| made.status.state == MeasureState::Done).count()
}

sim::sizes!(strokes_in_free_air_stay_near_the_origin_and_complete, strokes_complete(2), strokes_complete(40));

fn strokes_complete(count: usize) {
    let done = driven("free air", count, Task::Strokes, &[]);
    assert!(10 * done >= 9 * count, "{done}");
}

sim::sizes!(jogs_complete, complete_jogs(4), complete_jogs(20));

fn complete_jogs(count: usize) {
    let done = driven("jogs", count, Task::Jog, &[("direction_confirmed = 1", "direction_confirmed = 0")]);
    assert!(10 * done >= 9 * count, "{done}");
}

sim::sizes!(an_object_in_the_way_is_pressed_with_no_more_than_300_mn, strokes_stop_at_an_object: 1, 20);

/// An object from 0.1 to 1.2 mm ahead, on the array or off it.
fn strokes_stop_at_an_object(count: usize) {
    let near = ("distance_mm = { uniform = [2, 8] }", "distance_mm = { uniform = [0.1, 1.2] }");
    let off = ("centre_x_mm = { uniform = [-3.5, 3.5] }", "centre_x_mm = 20");
    driven("an object ahead", count, Task::Strokes, &[near]);
    driven("an object ahead, off the array", count, Task::Strokes, &[near, off]);
}

/// The tip must not go far before the strokes end.
#[test]
fn strokes_of_a_broken_drive_end_near_the_origin() {
    type Case = (fn(&mut Faults), &'static [Ended]);
    let cases: [Case; 5] = [
        (|faults| faults.encoder_reversed = true, &[Ended::Reversed]),
        (|faults| faults.leads_swapped = true, &[Ended::Reversed]),
        (|faults| faults.encoder_frozen = true, &[Ended::Still]),
        (|faults| faults.end_stops_mm = Some([-0.1, 5.0]), &[Ended::Pushed, Ended::Still]),
        (|faults| faults.end_stops_mm = Some([-5.0, 0.1]), &[Ended::Pushed, Ended::Still]),
    ];
    for (number, (defect, ends)) in cases.into_iter().enumerate() {
        let Made { status, fault, travel_mm, .. } = make(harmed(defect), Task::Strokes, |_, _| {});
        let ended = ends.contains(&status.ended) || fault.is_some();
        assert!(travel_mm < STROKES_MM && ended, "case {number}: {:?}, {fault:?}, {travel_mm:.2} mm", status.ended);
    }
}
