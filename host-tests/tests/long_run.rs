//! Filters and integrators of the loop in the long run, for any number of steps.
//!
//! Each is a machine with finitely many states. Under an input that repeats it must come to a state that it was in
//! before, and from then on it repeats itself for ever: finding that cycle proves what any number of steps would show.
//! A cycle of length 1 is rest. What is left to measure is how far the outputs swing within the cycle, which is the
//! limit cycle, and where they stand.

use crate::common::*;
use fingertip::config::GAIN_SETS;
use fingertip::control::{Drive, Observer, Winding};
use sim::cores;

/// Steps before the cycle, at most; steps of a cycle; and the state at its beginning.
type Cycle<S> = (u64, u64, S);

/// The cycle of a machine by Brent's method, or none within `most` steps.
fn cycle<S: Clone + PartialEq>(start: &S, most: u64, mut step: impl FnMut(&mut S)) -> Option<Cycle<S>> {
    let (mut mark, mut state) = (start.clone(), start.clone());
    let (mut window, mut length) = (1, 0);
    for lead in 1..=most {
        step(&mut state);
        length += 1;
        if state == mark {
            return Some((lead - length, length, state));
        }
        if length == window {
            mark = state.clone();
            window *= 2;
            length = 0;
        }
    }
    None
}

/// An output's name, its value in units of the last place, and its documented swing.
type Output<S> = (&'static str, fn(&S) -> i64, i64);

/// Expects that a machine comes to a cycle, and that no output swings farther in it than documented. A step is one
/// period of the input.
fn judge<S: Clone + PartialEq>(name: &str, start: &S, outputs: &[Output<S>], step: impl Fn(&mut S)) {
    let (lead, length, mut state) =
        cycle(start, 200_000_000, &step).unwrap_or_else(|| panic!("{name}: it comes to no cycle"));
    let mut ranges: Vec<_> = outputs.iter().map(|(_, value, _)| [value(&state); 2]).collect();
    for _ in 0..length {
        step(&mut state);
        for ([low, high], (_, value, _)) in ranges.iter_mut().zip(outputs) {
            (*low, *high) = ((*low).min(value(&state)), (*high).max(value(&state)));
        }
    }
    for ([low, high], (output, _, allowed)) in ranges.into_iter().zip(outputs) {
        let swing = high - low;
        assert!(swing <= *allowed, "{name}: {output} swings {swing} of {allowed} in {length} periods after {lead}");
    }
}

/// The judge itself finds known cycles, and measures their swing.
#[test]
fn known_cycles_are_found_and_measured() {
    let step = |x: &mut u32| *x = if *x < 100 { *x + 1 } else { 94 };
    let (lead, length, begin) = cycle(&0, 10_000, step).unwrap();
    assert!(length == 7 && lead >= 94 && (94..=100).contains(&begin));
    assert_eq!(cycle(&5, 10, |_: &mut i32| {}), Some((0, 1, 5)));
    assert_eq!(cycle(&0_u64, 100_000, |x| *x += 1), None);
    for (allowed, passes) in [(5, true), (4, false)] {
        let judged = std::panic::catch_unwind(|| judge("two-step", &0, &[("value", |x| *x, allowed)], |x| *x = 5 - *x));
        assert_eq!(judged.is_ok(), passes);
    }
}

const SUPPLY_MV: u16 = 6_000;
/// Fastest and slowest scan, and the one between.
const SCANS: [(&str, i32, i32); 3] = [("fast", 500, 3), ("default", 2_400, 15), ("slow", 100_000, 480)];

/// Documented limit cycles of the observer, in units of the last place: 60 pm, 2 um/s, 4 mm/s^2.
const TRAVEL_SWING: i64 = 1;
/// Limit cycle of the travel with the calmest gain set: at most 0.7 nm.
const CALM_TRAVEL_SWING: i64 = 12;
const SPEED_SWING: i64 = 131;
const DISTURBANCE_SWING: i64 = 1_024;

type Run = Box<dyn FnOnce() + Send>;

sim::sizes!(nothing_in_the_loop_drifts_or_swings, rests_or_repeats(false), rests_or_repeats(true));

/// Runs all filters and integrators. With `longest` the winding has its longest time constants, else its usual ones.
fn rests_or_repeats(longest: bool) {
    let mut runs: Vec<Run> = Vec::new();
    for (scan, settle_ns, sample_cycles) in SCANS {
        let config = allowed(Params { settle_ns, sample_cycles, ..cool() });
        observers(&mut runs, scan, &config);
        drives(&mut runs, scan, &config);
        loops(&mut runs, scan, &config);
    }
    arrays(&mut runs);
    windings(&mut runs, longest);
    cores::map(runs, |run| run());
}

/// Parameters of a motor that stays cool, for the machines that contain the winding model. The winding is examined
/// alone, as it limits the current: current and winding state together repeat after too many steps to wait for.
fn cool() -> Params {
    Params { winding_k_per_w: 0, housing_k_per_w: 0, ..images::CONFIRMED }
}

/// Encoder and acceleration, held or in turns.
fn observers(runs: &mut Vec<Run>, scan: &str, config: &Config) {
    let limit = config.current_max_q8_mm_per_s2;
    let inputs = [
        ("nothing", [(0, 0); 2]),
        ("one count", [(1, 0); 2]),
        ("a blocked motor at its current limit", [(0, limit); 2]),
        ("the least acceleration", [(0, 1); 2]),
        ("the encoder at its end", [(i32::MAX, limit); 2]),
        ("the encoder at its other end", [(i32::MIN, -limit); 2]),
        ("one count in turns", [(0, 0), (1, 0)]),
        ("the current limit in turns", [(0, limit), (0, -limit)]),
        ("the encoder's ends in turns", [(i32::MIN, i32::MAX), (i32::MAX, i32::MIN)]),
        ("the ends of the acceleration's type in turns", [(0, i32::MAX), (1, i32::MIN)]),
    ];
    let gain_sets = [(0, TRAVEL_SWING), (GAIN_SETS - 1, CALM_TRAVEL_SWING)];
    for ((input, pair), (gain_set, travel_swing)) in
        inputs.into_iter().flat_map(|input| gain_sets.map(|set| (input, set)))
    {
        let (config, name) = (config.clone(), format!("observer, {scan} scan, gain set {gain_set}, {input}"));
        let outputs: [Output<Observer>; 3] = [
            ("travel", |observer| observer.travel.to_bits().into(), travel_swing),
            ("speed", |observer| observer.speed.to_bits().into(), SPEED_SWING),
            ("disturbance", |observer| observer.disturbance.to_bits().into(), DISTURBANCE_SWING),
        ];
        let step = move |observer: &mut Observer| {
            for (encoder, acceleration) in pair {
                observer.update(encoder, acceleration, &config.gain_sets[gain_set], &config);
            }
        };
        runs.push(Box::new(move || judge(&name, &Observer::new(), &outputs, step)));
    }
}

/// The wanted acceleration, held or in turns.
fn drives(runs: &mut Vec<Run>, scan: &str, config: &Config) {
    let far = i32::MAX;
    for (input, pair) in
        [("nothing", [0; 2]), ("all", [far; 2]), ("all in turns", [far, -far]), ("the least in turns", [1, -1])]
    {
        let (config, name) = (config.clone(), format!("drive, {scan} scan, {input} wanted"));
        let step = move |drive: &mut Drive| {
            for wanted in pair {
                drive.apply(wanted, 0, SUPPLY_MV, &config, &mut Limits::default());
            }
        };
        let outputs: [Output<Drive>; 1] = [("acceleration", |drive| drive.acceleration().into(), 0)];
        runs.push(Box::new(move || judge(&name, &Drive::new(), &outputs, step)));
    }
}

/// Observer and drive joined by the control law, with a blocked motor and a constant or alternating position error.
fn loops(runs: &mut Vec<Run>, scan: &str, config: &Config) {
    for (input, pair) in
        [("none", [0; 2]), ("1 um", [1 << 14; 2]), ("far", [i32::MAX; 2]), ("far in turns", [i32::MAX, i32::MIN])]
    {
        let (config, name) = (config.clone(), format!("speed loop, {scan} scan, blocked motor, error {input}"));
        let outputs: [Output<SpeedLoop>; 4] = [
            ("travel", |motion| motion.observer.travel.to_bits().into(), CALM_TRAVEL_SWING),
            ("speed", |motion| motion.observer.speed.to_bits().into(), SPEED_SWING),
            ("disturbance", |motion| motion.observer.disturbance.to_bits().into(), DISTURBANCE_SWING),
            ("acceleration", |motion| motion.drive.acceleration().into(), DISTURBANCE_SWING),
        ];
        let step = move |motion: &mut SpeedLoop| {
            for way in pair.map(Millimetres::from_bits) {
                motion.observe(0, &config);
                let (reference, _) = motion.towards(way, config.count, config.speed_max, &config);
                motion.follow(reference, SUPPLY_MV, &config, &mut Limits::default());
            }
        };
        runs.push(Box::new(move || judge(&name, &SpeedLoop::new(), &outputs, step)));
    }
}

/// Frame with this preload, in codes above a level of 372, and as many more on the 16 taxels under a tip.
fn frame(preload: u16, codes: u16) -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
        let pressed = (3..7).contains(&slot) && (3..7).contains(&column);
        let preload = if slot < ROWS { preload } else { 0 };
        frame.set_code(slot, column, 372 + preload + if pressed { codes } else { 0 });
    }
    frame
}

/// A baseline that follows frames from a tare at 40 codes, and repeated tares; each of one frame, or of two in turns.
fn arrays(runs: &mut Vec<Run>) {
    let most = config().saturated_codes - 372 - 1;
    for (input, pair, follows) in [
        ("baseline, as tared", [40; 2], true),
        ("baseline, one code more", [41; 2], true),
        ("baseline, almost dead", [12; 2], true),
        ("baseline, almost saturated", [most; 2], true),
        ("baseline, one code in turns", [40, 41], true),
        ("baseline, the extremes in turns", [12, most], true),
        ("tares of one frame", [40; 2], false),
        ("tares of the extremes in turns", [12, most], false),
    ] {
        let (config, frames) = (config(), pair.map(|preload| frame(preload, 0)));
        let start = if follows { tared(&Calibration::NONE, &frame(40, 0), &config) } else { Array::new() };
        let follow = |array: &mut Array, frame: &Frame, config: &Config| {
            array.read(frame, config);
            array.follow_drift(64);
        };
        let tare = |array: &mut Array, frame: &Frame, config: &Config| {
            array.start_tare(false);
            for _ in 0..TARE_FRAMES {
                array.read(frame, config);
                array.continue_tare();
            }
        };
        let step = move |array: &mut Array| match follows {
            // Ten rows, one a frame: the shortest time after which the same row meets the same frame.
            true => frames.iter().cycle().take(ROWS).for_each(|frame| follow(array, frame, &config)),
            false => frames.iter().for_each(|frame| tare(array, frame, &config)),
        };
        // Zeros are converter codes in Q16.
        let outputs: [Output<Array>; 1] =
            [("sum of the tares", |array| array.tare().flatten().map(|tare| i64::from(*tare)).sum(), 0)];
        runs.push(Box::new(move || judge(input, &start, &outputs, step)));
    }
}

/// The usual lags, or the longest, without current, at the limit, and in turns.
fn windings(runs: &mut Vec<Run>, longest: bool) {
    let [winding_time_ms, housing_time_ms] = if longest { [600_000, 10_000_000] } else { [5_000, 400_000] };
    let config = allowed(Params { winding_time_ms, housing_time_ms, ..images::CONFIRMED });
    let limit = config.current_max_q8_mm_per_s2;
    for (input, pair) in [("none", [0; 2]), ("the limit", [limit; 2]), ("extremes in turns", [0, i32::MAX])] {
        let (config, name) = (config.clone(), format!("winding over {} s, {input}", housing_time_ms / 1_000));
        let step = move |winding: &mut Winding| {
            for net in pair.into_iter().cycle().take(1 << config.heat.frames_bits) {
                winding.observe(net, &config);
            }
        };
        let outputs: [Output<Winding>; 1] = [("share", |winding| winding.share().into(), 0)];
        runs.push(Box::new(move || judge(&name, &Winding::new(), &outputs, step)));
    }
}

/// The baseline visits a row of ten a frame, a refinement of the fit takes eleven frames, and a step of the winding's
/// model 256: the pipeline can repeat itself no sooner than after this many steps.
const PERIOD: u64 = 14_080;

/// Holds a goal with constant frames, the given codes on 16 taxels and a constant encoder count, until only the frame
/// number changes in the pipeline from period to period.
fn hold(name: &str, torque: bool, goal_mn: i32, codes: u16) -> Status {
    let mut pipeline = Pipeline::new(&allowed(cool()));
    let sense = Sense { supply_mv: SUPPLY_MV, ..Sense::default() };
    let mut command = Command { tare_request: 1, ..Command::default() };
    let mut shown = frame(40, 0);
    let mut steps = |command: &Command, shown: &mut Frame, count: u64| {
        let step = |_| {
            shown.sequence = shown.sequence.wrapping_add(1);
            *pipeline.step(shown, &sense, command).1
        };
        let status = (0..count).map(step).last();
        // Every field of the pipeline but the number of the frame.
        (status, format!("{pipeline:?}").replace(&format!("sequence: {},", shown.sequence), ""))
    };
    steps(&command, &mut shown, u64::from(TARE_FRAMES) + 2);
    (command.torque, command.goal) = (torque, newtons(goal_mn));
    let mut shown = Frame { sequence: shown.sequence, ..frame(40, codes) };
    for power in 10..25 {
        let (_, before) = steps(&command, &mut shown, 1 << power);
        let (status, after) = steps(&command, &mut shown, PERIOD);
        if before == after {
            return status.expect("a period has steps");
        }
    }
    panic!("{name}: it still changes")
}

#[test]
fn the_pipeline_comes_to_rest_under_what_does_not_change() {
    for (name, torque, goal_mn, codes, mode, fault) in [
        ("off", false, 0, 0, Mode::Off, None),
        ("off, with a drifted array", false, 0, 1, Mode::Off, None),
        ("released", true, 0, 0, Mode::Release, None),
        ("released, with a drifted array", true, 0, 1, Mode::Release, None),
        // A motor that is driven ever harder and does not turn is not driven for ever.
        ("pressing with less than the goal", true, 7_000, 60, Mode::Fault, Some(Fault::EncoderFrozen)),
        ("pressing with more than the goal", true, 50, 1_500, Mode::Fault, Some(Fault::EncoderFrozen)),
    ] {
        let status = hold(name, torque, goal_mn, codes);
        assert_eq!((status.mode, status.fault), (mode, fault), "{name}");
    }
}

#[test]
fn the_observer_recovers_from_anything() {
    for (settle_ns, sample_cycles, speed_max_um_per_s) in
        [(500, 3, 2_000_000), (2_400, 15, 250_000), (100_000, 480, 1_000)]
    {
        let approach_um_per_s = speed_max_um_per_s.min(Params::DEFAULT.approach_um_per_s);
        let params = Params { settle_ns, sample_cycles, speed_max_um_per_s, approach_um_per_s, ..images::CONFIRMED };
        let config = allowed(params);
        let mut rng = Rng::with_seed(11);
        for _ in 0..300 {
            let mut observer = Observer::new();
            let (reach, frames) = (1 << rng.u32(1..31), rng.u32(1..200));
            for _ in 0..frames {
                observer.update(rng.i32(-reach..reach), rng.i32(..), &config.gain_sets[0], &config);
            }
            let encoder = rng.i32(-50_000..50_000);
            let step = |observer: &mut Observer| observer.update(encoder, 0, &config.gain_sets[0], &config);
            let (.., rest) = cycle(&observer, 100_000, step).expect("a cycle");
            let measured = rest.measured(encoder, &config).to_bits();
            assert!((rest.travel.to_bits() - measured).abs() <= 1, "{rest:?} at {measured}");
            assert!(rest.speed.to_bits().abs() <= 131 && rest.disturbance.to_bits().abs() <= 1_024, "{rest:?}");
        }
    }
}
