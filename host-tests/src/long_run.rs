//! Filters and integrators of the loop in the long run, for any number of steps.
//!
//! Each is a machine with finitely many states. Under an input that repeats it must come to a state that it was in
//! before, and from then on it repeats itself for ever: finding that cycle proves what any number of steps would show.
//! A cycle of length 1 is rest. What is left to measure is how far the outputs swing within the cycle, which is the
//! limit cycle, and where they stand.

use crate::stimulus::config;
use fingertip::command::Command;
use fingertip::config::{GAIN_SETS, newtons};
use fingertip::control::{Drive, Observer, SpeedLoop, Winding};
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{Array, Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};
use fingertip::state::Limits;
use fingertip::units::Millimetres;
use sim::cores;

/// End state of a machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// Steps before it repeats itself, at most.
    pub lead: u64,
    /// Steps until the same state comes again; a step is a period of the input.
    pub length: u64,
}

/// The cycle of a machine by Brent's method, or none within `most` steps; and the state at its beginning.
pub fn cycle<S: Clone + PartialEq>(start: &S, most: u64, mut step: impl FnMut(&mut S)) -> Option<(Cycle, S)> {
    let (mut mark, mut state) = (start.clone(), start.clone());
    let (mut window, mut length) = (1, 0);
    for lead in 1..=most {
        step(&mut state);
        length += 1;
        if state == mark {
            return Some((Cycle { lead: lead - length, length }, state));
        }
        if length == window {
            mark = state.clone();
            window *= 2;
            length = 0;
        }
    }
    None
}

/// Result of a run of a machine.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The machine and its input.
    pub name: String,
    pub cycle: Cycle,
    /// Name, swing within the cycle and documented swing of each output, in units of the last place.
    pub swings: Vec<(&'static str, i64, i64)>,
}

impl Outcome {
    /// True if every output swings no more than documented.
    pub fn passes(&self) -> bool {
        self.swings.iter().all(|(_, swing, allowed)| swing <= allowed)
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Cycle { lead, length } = self.cycle;
        let kind = if length == 1 { "rests".into() } else { format!("repeats every {length} periods") };
        write!(f, "{}: {kind} after {lead} periods;", self.name)?;
        for (name, swing, allowed) in &self.swings {
            write!(f, " {name} swings {swing} of {allowed}")?;
        }
        Ok(())
    }
}

/// A machine under an input that repeats; a step is one period of the input.
pub struct Machine<S> {
    /// Name of the machine and its input.
    pub name: String,
    pub start: S,
    /// One period of the input.
    pub step: Box<dyn Fn(&mut S) + Send>,
    /// The outputs, with the swing allowed in a cycle.
    pub outputs: Vec<Output<S>>,
}

/// An output's name, its value in units of the last place, and its documented swing.
pub type Output<S> = (&'static str, fn(&S) -> i64, i64);

impl<S: Clone + PartialEq + 'static> Machine<S> {
    /// Finds the cycle and measures it.
    pub fn run(&self, most: u64) -> Outcome {
        let found = cycle(&self.start, most, &self.step);
        let (cycle, begin) = found.unwrap_or_else(|| panic!("{}: no cycle within {most} steps", self.name));
        let mut state = begin.clone();
        let mut ranges: Vec<_> = self.outputs.iter().map(|(_, output, _)| (output(&begin), output(&begin))).collect();
        for _ in 0..cycle.length {
            (self.step)(&mut state);
            for (range, (_, output, _)) in ranges.iter_mut().zip(&self.outputs) {
                let value = output(&state);
                *range = (range.0.min(value), range.1.max(value));
            }
        }
        let swings =
            self.outputs.iter().zip(ranges).map(|((name, _, allowed), (low, high))| (*name, high - low, *allowed));
        Outcome { name: self.name.clone(), cycle, swings: swings.collect() }
    }
}

/// The baseline visits a row of ten a frame, a refinement of the fit takes eleven frames, and a step of the winding's
/// model 256: the pipeline can repeat itself no sooner than after this many steps.
const PERIOD: u64 = 14_080;

/// Frame with this preload, in codes above a level of 372, and as many more on the 16 taxels under a tip.
fn frame(preload: u16, codes: u16) -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..10).map(move |column| (slot, column))) {
        let pressed = (3..7).contains(&slot) && (3..7).contains(&column);
        let preload = if slot < ROWS { preload } else { 0 };
        frame.set_code(slot, column, 372 + preload + if pressed { codes } else { 0 });
    }
    frame
}

/// Holds a goal with constant frames, the given codes on 16 taxels and a constant encoder count, until only the frame
/// number changes in the pipeline from period to period.
pub fn hold(name: &str, torque: bool, goal_mn: i32, codes: u16, most: u64) -> (Outcome, Status) {
    let mut pipeline = Pipeline::new(&Config::shipped(&cool()).expect("the defaults are allowed"));
    let sense = Sense { supply_mv: 6_000, ..Sense::default() };
    let mut command = Command { tare_request: 1, ..Command::default() };
    let mut shown = frame(40, 0);
    let step = |pipeline: &mut Pipeline, command: &Command, shown: &mut Frame| {
        shown.sequence = shown.sequence.wrapping_add(1);
        *pipeline.step(shown, &sense, command).1
    };
    for _ in 0..TARE_FRAMES + 2 {
        step(&mut pipeline, &command, &mut shown);
    }
    command.torque = torque;
    command.goal = newtons(goal_mn);
    let mut shown = Frame { sequence: shown.sequence, ..frame(40, codes) };

    let (mut taken, mut next) = (0, 1_024);
    while taken < most {
        for _ in 0..next {
            step(&mut pipeline, &command, &mut shown);
        }
        let before = state(&pipeline, shown.sequence);
        let mut status = Status::default();
        for _ in 0..PERIOD {
            status = step(&mut pipeline, &command, &mut shown);
        }
        taken += next + PERIOD;
        if state(&pipeline, shown.sequence) == before {
            let cycle = Cycle { lead: taken - PERIOD, length: PERIOD };
            return (Outcome { name: name.into(), cycle, swings: vec![] }, status);
        }
        next *= 2;
    }
    panic!("{name}: still changes after {taken} steps")
}

/// Every field of the pipeline, but the number of the frame.
fn state(pipeline: &Pipeline, sequence: u32) -> String {
    format!("{pipeline:?}").replace(&format!("sequence: {sequence},"), "")
}

/// Steps within which a machine must come to its cycle.
const MOST: u64 = 200_000_000;
const SUPPLY_MV: u16 = 6_000;
/// Fastest and slowest scan, and the one between.
const SCANS: [(&str, i32, i32); 3] = [("fast", 500, 3), ("default", 2_400, 15), ("slow", 100_000, 480)];

/// Documented limit cycles of the observer, in units of the last place: 60 pm, 2 um/s, 4 mm/s^2.
const TRAVEL_SWING: i64 = 1;
/// Limit cycle of the travel with the calmest gain set: at most 0.7 nm.
const CALM_TRAVEL_SWING: i64 = 12;
const SPEED_SWING: i64 = 131;
const DISTURBANCE_SWING: i64 = 1_024;

/// Runs all filters and integrators. With `longest` the winding has its longest time constants, else its usual ones.
pub fn all(longest: bool) -> Vec<Outcome> {
    let mut runs: Vec<Run> = Vec::new();
    for (scan, settle_ns, sample_cycles) in SCANS {
        let config = Config::shipped(&Params { settle_ns, sample_cycles, ..cool() }).expect("allowed");
        queue(&mut runs, observers(scan, &config));
        queue(&mut runs, drives(scan, &config));
        queue(&mut runs, loops(scan, &config));
    }
    queue(&mut runs, baselines());
    queue(&mut runs, tares());
    queue(&mut runs, windings(longest));
    cores::map(runs, |run| run())
}

/// Parameters of a motor that stays cool, for the machines that contain the winding model. The winding is examined
/// alone, as it limits the current: current and winding state together repeat after too many steps to wait for.
pub fn cool() -> Params {
    Params { winding_k_per_w: 0, housing_k_per_w: 0, ..images::CONFIRMED }
}

type Run = Box<dyn FnOnce() -> Outcome + Send>;

fn queue<S: Clone + PartialEq + Send + 'static>(runs: &mut Vec<Run>, machines: Vec<Machine<S>>) {
    runs.extend(machines.into_iter().map(|machine| Box::new(move || machine.run(MOST)) as Run));
}

/// Encoder and acceleration, held or in turns.
fn observers(scan: &str, config: &Config) -> Vec<Machine<Observer>> {
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
    let machine = |(input, pair): (&str, [(i32, i32); 2]), gain_set: usize| {
        let config = config.clone();
        let travel_swing = if gain_set == 0 { TRAVEL_SWING } else { CALM_TRAVEL_SWING };
        Machine {
            name: format!("observer, {scan} scan, gain set {gain_set}, {input}"),
            start: Observer::new(),
            step: Box::new(move |observer: &mut Observer| {
                let gains = &config.gain_sets[gain_set];
                pair.iter()
                    .for_each(|(encoder, acceleration)| observer.update(*encoder, *acceleration, gains, &config));
            }),
            outputs: vec![
                ("travel", |observer| observer.travel.to_bits().into(), travel_swing),
                ("speed", |observer| observer.speed.to_bits().into(), SPEED_SWING),
                ("disturbance", |observer| observer.disturbance.to_bits().into(), DISTURBANCE_SWING),
            ],
        }
    };
    inputs.into_iter().flat_map(|input| [0, GAIN_SETS - 1].map(|gain_set| machine(input, gain_set))).collect()
}

/// The wanted acceleration, held or in turns.
fn drives(scan: &str, config: &Config) -> Vec<Machine<Drive>> {
    let far = i32::MAX;
    let inputs =
        [("nothing", [0; 2]), ("all", [far; 2]), ("all in turns", [far, -far]), ("the least in turns", [1, -1])];
    let machine = |(input, pair): (&str, [i32; 2])| {
        let config = config.clone();
        Machine {
            name: format!("drive, {scan} scan, {input} wanted"),
            start: Drive::new(),
            step: Box::new(move |drive: &mut Drive| {
                for wanted in pair {
                    drive.apply(wanted, 0, SUPPLY_MV, &config, &mut Limits::default());
                }
            }),
            outputs: vec![("acceleration", |drive| drive.acceleration().into(), 0)],
        }
    };
    inputs.map(machine).into()
}

/// Observer and drive joined by the control law, with a blocked motor and a constant or alternating position error.
fn loops(scan: &str, config: &Config) -> Vec<Machine<SpeedLoop>> {
    let inputs =
        [("none", [0; 2]), ("1 um", [1 << 14; 2]), ("far", [i32::MAX; 2]), ("far in turns", [i32::MAX, i32::MIN])];
    let machine = |(input, pair): (&str, [i32; 2])| {
        let config = config.clone();
        Machine {
            name: format!("speed loop, {scan} scan, blocked motor, error {input}"),
            start: SpeedLoop::new(),
            step: Box::new(move |motion: &mut SpeedLoop| {
                for way in pair.map(Millimetres::from_bits) {
                    motion.observe(0, &config);
                    let (reference, _) = motion.towards(way, config.count, config.speed_max, &config);
                    motion.follow(reference, SUPPLY_MV, &config, &mut Limits::default());
                }
            }),
            outputs: vec![
                ("travel", |motion| motion.observer.travel.to_bits().into(), CALM_TRAVEL_SWING),
                ("speed", |motion| motion.observer.speed.to_bits().into(), SPEED_SWING),
                ("disturbance", |motion| motion.observer.disturbance.to_bits().into(), DISTURBANCE_SWING),
                ("acceleration", |motion| motion.drive.acceleration().into(), DISTURBANCE_SWING),
            ],
        }
    };
    inputs.map(machine).into()
}

/// Sum of the tares, codes in Q16.
fn tare_sum(array: &Array) -> i64 {
    array.tare().flatten().map(|tare| i64::from(*tare)).sum()
}

/// Frames held or in turns, from a tare at 40 codes.
fn baselines() -> Vec<Machine<Array>> {
    let most = config().saturated_codes - 372 - 1;
    let inputs = [
        ("as tared", [40; 2]),
        ("one code more", [41; 2]),
        ("almost dead", [12; 2]),
        ("almost saturated", [most; 2]),
        ("one code in turns", [40, 41]),
        ("the extremes in turns", [12, most]),
    ];
    let machine = |(input, pair): (&str, [u16; 2])| {
        let config = config();
        let frames = pair.map(|preload| frame(preload, 0));
        let mut start = Array::new();
        tare(&mut start, &frame(40, 0), &config);
        Machine {
            name: format!("baseline, {input}"),
            start,
            step: Box::new(move |array: &mut Array| {
                // Ten rows, one a frame: the shortest time after which the same row meets the same frame.
                for frame in frames.iter().cycle().take(ROWS) {
                    array.read(frame, &config);
                    array.follow_drift(64);
                }
            }),
            outputs: vec![("sum of the tares", tare_sum, 0)],
        }
    };
    inputs.map(machine).into()
}

fn tare(array: &mut Array, frame: &Frame, config: &Config) {
    array.start_tare();
    for _ in 0..TARE_FRAMES {
        array.read(frame, config);
        array.continue_tare();
    }
}

/// Repeated tares of one frame, or of two alternating frames.
fn tares() -> Vec<Machine<Array>> {
    let inputs = [("one frame", [40, 40]), ("the extremes in turns", [12, config().saturated_codes - 372 - 1])];
    let machine = |(input, pair): (&str, [u16; 2])| {
        let config = config();
        let frames = pair.map(|preload| frame(preload, 0));
        Machine {
            name: format!("tare, {input}"),
            start: Array::new(),
            step: Box::new(move |array: &mut Array| frames.iter().for_each(|frame| tare(array, frame, &config))),
            outputs: vec![("sum of the tares", tare_sum, 0)],
        }
    };
    inputs.map(machine).into()
}

/// The usual lags, or the longest, without current, at the limit, and in turns.
fn windings(longest: bool) -> Vec<Machine<Winding>> {
    let [winding_time_ms, housing_time_ms] = if longest { [600_000, 10_000_000] } else { [5_000, 400_000] };
    let params = Params { winding_time_ms, housing_time_ms, ..images::CONFIRMED };
    let inputs = [("none", [0; 2]), ("the limit", [1; 2]), ("extremes in turns", [0, i32::MAX])];
    let machine = |(input, pair): (&str, [i32; 2])| {
        let config = Config::shipped(&params).expect("allowed");
        let currents = if pair == [1; 2] { [config.current_max_q8_mm_per_s2; 2] } else { pair };
        let frames = 1 << config.heat.frames_bits;
        Machine {
            name: format!("winding over {} s, {input}", housing_time_ms / 1_000),
            start: Winding::new(),
            step: Box::new(move |winding: &mut Winding| {
                for net in currents.into_iter().cycle().take(frames as usize) {
                    winding.observe(net, &config);
                }
            }),
            outputs: vec![("share", |winding| winding.share().into(), 0)],
        }
    };
    inputs.map(machine).into()
}
