//! Properties of the pipeline for any frame, any sense and any command, in any order, under any parameters allowed.
//!
//! The tests run with overflow checks, so "does not panic" includes "does not overflow".

use crate::common::*;
use fingertip::config::{ConfigError, Gains};
use std::cell::RefCell;

// What a step may be given: frames, senses and commands, likely ones and any others.

/// Codes of the columns with no row driven, and the preload above them.
const UNDRIVEN: u16 = 372;
const PRELOAD: u16 = 40;

/// A frame.
#[derive(Clone, Debug)]
enum Codes {
    /// Sound array, with the given number of codes added on the taxels around a place.
    Contact { row: usize, column: usize, codes: u16 },
    /// A sound array but for one code.
    Odd { slot: usize, column: usize, code: u16 },
    /// Two codes in turns, or all alike.
    Checkerboard([u16; 2]),
    /// Two codes, alternating by row, as from a scan out of step.
    Stripes([u16; 2]),
    /// Anything.
    Noise(u64),
}

impl Codes {
    fn fill(&self, frame: &mut Frame) {
        let mut random = fastrand::Rng::with_seed(if let Self::Noise(seed) = self { *seed } else { 0 });
        for (slot, column) in (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
            let sound = if slot < ROWS { UNDRIVEN + PRELOAD } else { UNDRIVEN };
            let code =
                match *self {
                    Self::Contact { row, column: middle, codes } => {
                        let near = slot < ROWS && slot.abs_diff(row) <= 2 && column.abs_diff(middle) <= 2;
                        sound + if near { codes >> (slot.abs_diff(row) + column.abs_diff(middle)) } else { 0 }
                    }
                    Self::Odd { slot: odd_slot, column: odd_column, code } => {
                        if (slot, column) == (odd_slot, odd_column) { code } else { sound }
                    }
                    Self::Checkerboard(codes) => codes[(slot + column) % 2],
                    Self::Stripes(codes) => codes[slot % 2],
                    Self::Noise(_) => random.u16(..),
                };
            frame.set_code(slot, column, code);
        }
    }
}

/// Motion of the encoder.
#[derive(Clone, Debug)]
enum Turn {
    By(i32),
    To(i32),
}

/// Changes from one step to the next.
#[derive(Clone, Debug)]
struct Input {
    codes: Codes,
    /// Sequence numbers left out.
    missed: u32,
    turn: Turn,
    /// What is sensed besides the encoder.
    sense: Sense,
    /// The command, where the numbers of the requests are added to those before.
    command: Command,
}

/// The arguments of the next step.
fn next(Record { frame, sense, command }: &mut Record, input: &Input) {
    input.codes.fill(frame);
    frame.sequence = frame.sequence.wrapping_add(1).wrapping_add(input.missed);
    let encoder = match input.turn {
        Turn::By(counts) => sense.encoder.wrapping_add(counts),
        Turn::To(count) => count,
    };
    *sense = Sense { encoder, ..input.sense };
    let tare_request = command.tare_request.wrapping_add(input.command.tare_request);
    *command = Command {
        tare_request,
        // One of four tares is forced.
        tare_forced: tare_request.is_multiple_of(4),
        clear_request: command.clear_request.wrapping_add(input.command.clear_request),
        // Its lowest bits name a task.
        measure_request: command.measure_request.wrapping_add(input.command.measure_request),
        ..input.command
    };
}

fn code() -> impl Strategy<Value = u16> {
    prop_oneof![Just(0), Just(3_839), Just(3_840), Just(4_095), Just(u16::MAX), any::<u16>(), 300..700_u16]
}

fn codes() -> impl Strategy<Value = Codes> {
    prop_oneof![
        40 => (0..ROWS, 0..COLUMNS, prop_oneof![Just(0), 0..3_600_u16])
            .prop_map(|(row, column, codes)| Codes::Contact { row, column, codes }),
        3 => (0..SLOTS, 0..COLUMNS, code()).prop_map(|(slot, column, code)| Codes::Odd { slot, column, code }),
        1 => code().prop_map(|code| Codes::Checkerboard([code; 2])),
        1 => [code(), code()].prop_map(Codes::Checkerboard),
        1 => [code(), code()].prop_map(Codes::Stripes),
        1 => any::<u64>().prop_map(Codes::Noise),
    ]
}

fn turn() -> impl Strategy<Value = Turn> {
    prop_oneof![
        20 => (-60..60).prop_map(Turn::By),
        // A jog waits until the tip is at rest.
        8 => Just(Turn::By(0)),
        2 => any::<i32>().prop_map(Turn::By),
        1 => prop_oneof![Just(i32::MIN), Just(i32::MAX), Just(0), any::<i32>()].prop_map(Turn::To),
    ]
}

/// Any input; sound ones more often, so that the loop also gets somewhere.
fn any_input() -> impl Strategy<Value = Input> {
    let sense = (
        turn(),
        prop_oneof![20 => 5_500..7_000_u16, 1 => Just(0), 1 => Just(u16::MAX), 1 => any::<u16>()],
        prop_oneof![10 => Just(0), 1 => any::<u16>()],
        prop::bool::weighted(0.005),
    );
    // Numbers added to those of the requests for a tare, which takes the motor away for many frames, a clear and a motion.
    let requests = [400, 5, 10].map(|none| prop_oneof![none => Just(0), 1 => any::<u8>()]);
    let command = (
        prop::bool::weighted(0.9),
        prop_oneof![10 => 0..9 << 16, 2 => Just(0), 1 => Just(i32::MIN), 1 => Just(i32::MAX), 1 => any::<i32>()],
        prop_oneof![10 => Just(0), 1 => any::<u16>()],
        requests,
    );
    let missed = prop_oneof![20 => Just(0), 1 => any::<u32>()];
    (codes(), missed, sense, command).prop_map(
        |(codes, missed, (turn, supply_mv, bus_silent_ms, bridge_fault), command)| {
            let (torque, goal_bits, bus_watchdog_ms, [tare_request, clear_request, measure_request]) = command;
            let requests = Command { tare_request, clear_request, measure_request, ..Command::default() };
            let command = Command { torque, goal: Newtons::from_bits(goal_bits), bus_watchdog_ms, ..requests };
            let sense = Sense { supply_mv, bus_silent_ms, bridge_fault, ..Sense::default() };
            Input { codes, missed, turn, sense, command }
        },
    )
}

/// A run of inputs.
fn any_inputs(most: usize) -> impl Strategy<Value = Vec<Input>> {
    // Held inputs let the integrators run up; changing ones jerk them.
    let held = (any_input(), 1..400_usize).prop_map(|(input, times)| vec![input; times]);
    let runs = prop::collection::vec(held, 1..6);
    prop_oneof![prop::collection::vec(any_input(), 1..most), runs.prop_map(|runs| runs.concat())]
}

// Parameters at and between the ends of their ranges, and the configurations they make.

/// The sampling times that the converter has.
const SAMPLE_CYCLES: [i32; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// Place of each parameter in its range.
#[derive(Clone, Copy, Debug)]
enum Place {
    Least,
    Largest,
    Default,
    /// This share of the range, on a scale of ratios.
    Between(f64),
}

/// The parameters with each at its place, and those that contradict each other moved apart.
fn placed(places: impl IntoIterator<Item = Place>) -> Params {
    let mut values = Params::DEFAULT.to_array();
    for ((value, place), (_, default, min, max)) in values.iter_mut().zip(places).zip(Params::RANGES) {
        *value = match place {
            Place::Least => min,
            Place::Largest => max,
            Place::Default => default,
            Place::Between(share) => {
                let (low, high) = (f64::from(min).max(1.0), f64::from(max).max(1.0));
                ((low * (high / low).powf(share)) as i32).clamp(min, max)
            }
        };
    }
    let mut params = Params::from_array(&values);
    let nearest = SAMPLE_CYCLES.into_iter().min_by_key(|cycles| cycles.abs_diff(params.sample_cycles));
    params.sample_cycles = nearest.expect("there are some");
    apart(&mut params.contact_off_mn, &mut params.contact_on_mn, 2_000);
    apart(&mut params.contact_on_mn, &mut params.force_max_mn, 150_000);
    apart(&mut params.force_max_mn, &mut params.force_fault_mn, 200_000);
    params.approach_um_per_s = params.approach_um_per_s.min(params.speed_max_um_per_s);
    apart(&mut params.supply_min_mv, &mut params.supply_max_mv, 60_000);
    // The least supply gives a quarter of the largest voltage.
    params.voltage_max_mv = params.voltage_max_mv.min(4 * params.supply_min_mv);
    // A curve leaves a code of a kPa at the full range.
    params.codes_per_kpa_milli = params.codes_per_kpa_milli.max(1_000 + params.curve_permille);
    // The converter sees four least contacts: smaller ones, or fewer codes for each kPa.
    while let Err(ConfigError::Seen { seen_mn, .. }) = Config::shipped(&params) {
        if seen_mn < 20 {
            params.codes_per_kpa_milli = (params.codes_per_kpa_milli / 2).max(1_000 + params.curve_permille);
        } else {
            params.contact_on_mn = seen_mn / 4;
            params.contact_off_mn = params.contact_off_mn.min(params.contact_on_mn - 1);
        }
    }
    params
}

/// Puts the first below the second, which may go up to `max`.
fn apart(low: &mut i32, high: &mut i32, max: i32) {
    if *low >= *high {
        *high = (*low + 1).min(max);
        *low = *high - 1;
    }
}

fn place() -> impl Strategy<Value = Place> {
    prop_oneof![Just(Place::Least), Just(Place::Largest), Just(Place::Default), (0.0..=1.0).prop_map(Place::Between)]
}

/// Valid parameters, more often at the ends of their ranges; the direction is confirmed in nine of ten.
fn any_params() -> impl Strategy<Value = Params> {
    let params = prop_oneof![
        1 => Just(Params::DEFAULT),
        4 => prop::collection::vec(place(), Params::COUNT).prop_map(placed),
        4 => prop::collection::vec(prop_oneof![Just(Place::Least), Just(Place::Largest)], Params::COUNT).prop_map(placed),
    ];
    (params, prop::bool::weighted(0.9))
        .prop_map(|(params, confirmed)| Params { direction_confirmed: confirmed.into(), ..params })
}

/// Configuration, after checks of the properties that the loop's arithmetic needs.
fn config(params: &Params) -> Config {
    let config = allowed(*params);
    let positive = [config.mm_per_count_q40, config.newtons_per_sum_q48, config.pascals_per_sum_q32];
    assert!(positive.iter().all(|value| (1..1 << 61).contains(value)), "{config:?}");
    assert!(config.force_seen > Newtons::ZERO && config.force_seen <= config.tip.force_max(), "{config:?}");
    // Room for the rounding of its quotient; a motor too weak for the acceleration's resolution is not driven.
    assert!((1..u32::MAX - 65_535).contains(&config.duty_gain) || config.voltage_max_q8_mm_per_s2 == 0, "{config:?}");
    let positive = [config.frame_s_q37, config.counts_max, config.settled_band.to_bits(), config.bounds.leak];
    let gains = config.gain_sets.iter().flat_map(|gains| {
        let Gains { observer: [l1, l2, l3], speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40 } =
            *gains;
        [l1, l2, l3, speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40]
    });
    // Below the limit of their type: they were not clamped.
    assert!(positive.into_iter().chain(gains).all(|value| (1..i32::MAX).contains(&value)), "{config:?}");
    // 0 where the motor is too weak for the acceleration's resolution: then it is not driven.
    assert!(config.voltage_max_q8_mm_per_s2 >= 0 && config.current_max_q8_mm_per_s2 >= 0, "{config:?}");
    assert!(config.slew_max_q8_mm_per_s2 >= 0 && config.damping_q17_per_s >= 0, "{config:?}");
    config
}

#[test]
fn every_corner_of_the_parameters_makes_a_configuration() {
    for rest in [Place::Least, Place::Largest, Place::Default] {
        config(&placed([rest; Params::COUNT]));
        for odd in 0..Params::COUNT {
            for place in [Place::Least, Place::Largest] {
                let mut places = [rest; Params::COUNT];
                places[odd] = place;
                config(&placed(places));
            }
        }
    }
}

/// Runs of each test, the same ones every time.
const CASES: u32 = 500;
const SEED: u64 = 20_030_914;

/// A pipeline and its last inputs.
#[derive(Clone)]
struct Run {
    pipeline: Pipeline,
    arguments: Record,
    before: Status,
    clear_seen: u8,
    /// A force of at least a contact's was read since the last tare began.
    touched: bool,
    /// Number of steps since the tip moved.
    still: u32,
    seen: Seen,
}

/// The numbers of the modes, faults, tasks and ends of motions that runs came to.
type Seen = [BTreeSet<u8>; 4];

impl Run {
    /// Tared where `tared` says so; a broken array may refuse.
    fn new(params: &Params, tared: bool) -> Self {
        let mut frame = Frame::EMPTY;
        Codes::Contact { row: 0, column: 0, codes: 0 }.fill(&mut frame);
        let sense = Sense { supply_mv: 6_000, ..Sense::default() };
        let mut run = Self {
            pipeline: Pipeline::new(&config(params)),
            arguments: Record { frame, sense, command: Command::default() },
            before: Status::default(),
            clear_seen: 0,
            touched: false,
            still: 0,
            seen: Seen::default(),
        };
        if tared {
            run.arguments.command.tare_request += 1;
            // And at rest for longer than a jog needs.
            for _ in 0..TARE_FRAMES + 25_000_000 / run.pipeline.config().timing.frame_ns {
                run.arguments.frame.sequence += 1;
                run.step();
            }
        }
        run
    }

    fn take(&mut self, inputs: &[Input]) {
        for input in inputs {
            next(&mut self.arguments, input);
            self.step();
        }
    }

    /// A step, with everything that must hold after it.
    fn step(&mut self) -> Status {
        let clear_before = core::mem::replace(&mut self.clear_seen, self.arguments.command.clear_request);
        let tares = self.arguments.command.tare_request != self.before.taken.tare;
        let measures = self.arguments.command.measure_request != self.before.taken.measure;
        let task = Task::of(self.arguments.command.measure_request);
        let strokes = measures && matches!(task, Task::Jog | Task::Strokes);
        let Record { frame, sense, command } = &self.arguments;
        let (duty, &status) = self.pipeline.step(frame, sense, command);

        assert!(duty.0 >= -Duty::FULL, "{duty:?}");
        assert_eq!(duty, status.duty);
        if !drives(status.mode) {
            assert_eq!(duty, Duty::ZERO, "{:?} does not drive", status.mode);
        }
        if !command.torque && status.mode != Mode::Strokes {
            assert!(!drives(status.mode), "{:?} without torque", status.mode);
        }
        assert_eq!(status.mode == Mode::Fault, status.fault.is_some());
        if self.before.mode == Mode::Fault {
            let cleared = command.clear_request != clear_before && !command.torque;
            let sound = match status.mode {
                // What is requested in the same frame may find the next fault.
                Mode::Fault if cleared => tares || strokes,
                Mode::Fault => status.fault == self.before.fault,
                Mode::Tare => cleared && tares,
                Mode::Strokes => cleared && strokes,
                Mode::Off => cleared && (!tares || status.tare == Taring::Refused),
                _ => false,
            };
            assert!(sound, "{:?} {:?} after {:?}", status.mode, status.fault, self.before.fault);
        }
        // A tare begins or is refused, and a measurement that was asked for runs, waits or is refused: nothing is lost.
        assert_eq!((status.taken.tare, status.taken.clear), (command.tare_request, command.clear_request));
        if tares {
            let faulted = status.mode == Mode::Fault;
            // What is pressed refuses a tare; the zero before remains.
            let tared = !self.before.limits.has(Limits::NOT_TARED) && !status.limits.has(Limits::NOT_TARED);
            let pressed = tared && self.touched && !command.tare_forced;
            let expected = if status.mode == Mode::Tare { Taring::Running } else { Taring::Refused };
            assert_eq!(status.tare, expected, "{:?}", status.mode);
            assert!(status.mode == Mode::Tare || faulted || pressed, "{:?} refuses a tare", status.mode);
            if self.before.mode == Mode::Force && !command.tare_forced {
                assert_eq!(status.tare, Taring::Refused, "a contact was held");
            }
        }
        self.still = if status.travel == self.before.travel { self.still + 1 } else { 0 };
        let least = self.pipeline.config().contact_on;
        self.touched = status.mode != Mode::Tare && (self.touched || status.contact.force >= least);
        assert_eq!(status.tare == Taring::Running, status.mode == Mode::Tare);
        let was_running = self.before.measure.state == MeasureState::Running;
        let runs = status.measure.state == MeasureState::Running;
        if measures && status.taken.measure != command.measure_request {
            // For torque, for rest, or for the frame after the one in which a motion was interrupted.
            let torque = task == Task::Press && command.torque;
            let interrupted = was_running && status.measure.ended == Ended::Interrupted;
            let rests = self.still > 20_000_000 / self.pipeline.config().timing.frame_ns + 2 && !self.before.braking;
            let rest = matches!(task, Task::Jog | Task::Strokes) && !rests;
            assert!(torque || rest || interrupted, "{task:?} waits in {:?}", status.mode);
        } else if measures && task != Task::Stop && !was_running {
            assert_eq!(status.measure.task, task);
            // Accepted or refused; a fault may end it in its first frame.
            assert!(runs || status.measure.state == MeasureState::Ended, "{status:?}");
        }
        assert!(!runs || status.mode != Mode::Press || status.measure.task == Task::Press);
        assert!(!runs || matches!(status.mode, Mode::Press | Mode::Strokes), "{status:?}");
        assert!(runs || status.mode != Mode::Strokes);
        let early = status.measure.value != 0 || status.measure.ended != Ended::Complete;
        assert_eq!(early, status.measure.state == MeasureState::Ended);
        if was_running && runs {
            let before = (self.before.mode, self.before.measure.task);
            assert_eq!((status.mode, status.measure.task), before, "another began");
        }
        if status.mode == Mode::Press && !measures {
            assert!(was_running, "a press goes on after its answer: {status:?}");
        }
        // Torque starts from the present goal and touch; a measurement begins only with its request.
        if drives(status.mode) && !drives(self.before.mode) && status.mode != Mode::Strokes {
            let sound = match status.mode {
                Mode::Approach | Mode::Force => command.goal > Newtons::ZERO,
                // With a goal only where the array's signal vanished, or on a silent bus: that is released first.
                Mode::Release => {
                    let silent = command.bus_watchdog_ms != 0 && sense.bus_silent_ms >= command.bus_watchdog_ms;
                    let vanished = status.contact.force < self.pipeline.config().contact_on;
                    command.goal <= Newtons::ZERO || silent || vanished
                }
                _ => measures,
            };
            assert!(sound, "{:?} first after {:?}", status.mode, self.before.mode);
        }
        let contact = status.contact;
        let tip = self.pipeline.config().tip;
        assert!(contact.force >= Newtons::ZERO);
        assert!((0..=tip.depth_max().to_bits()).contains(&contact.indentation.to_bits()));
        assert!((0..=100).contains(&contact.bad_taxels));
        let fault = status.fault.map_or(0, |fault| fault as u8);
        let numbers = [status.mode as u8, fault, status.measure.task as u8, status.measure.ended as u8];
        for (seen, number) in self.seen.iter_mut().zip(numbers) {
            seen.insert(number);
        }
        self.before = status;
        status
    }
}

proptest! {
    #![proptest_config(seeded(CASES, SEED))]

    /// Torque off, a stop from outside, and new parameters, whatever was commanded before. Nothing drives without torque,
    /// and torque on again forgets the old goal. A stop is latched. New parameters turn the bridge off, and the loop
    /// continues with them.
    #[test]
    fn torque_off_a_stop_and_new_parameters_act_at_any_moment(
        params in any_params(), second in any_params(), before in any_inputs(100), after in any_inputs(60),
    ) {
        let mut off = Run::new(&params, true);
        off.take(&before);
        let [mut stopped, mut changed] = [off.clone(), off.clone()];

        off.arguments.command.torque = false;
        for _ in 0..10 {
            prop_assert_eq!(off.step().duty, Duty::ZERO);
        }
        (off.arguments.command.torque, off.arguments.command.goal) = (true, Newtons::ZERO);
        let mode = off.step().mode;
        prop_assert!(matches!(mode, Mode::Release | Mode::Off | Mode::Tare | Mode::Fault), "{:?}", mode);

        stopped.pipeline.stop(Fault::LostFrames);
        stopped.before = *stopped.pipeline.status();
        prop_assert_eq!((stopped.before.mode, stopped.before.duty), (Mode::Fault, Duty::ZERO));
        prop_assert!(stopped.before.fault.is_some());
        stopped.take(&after);

        changed.pipeline.configure(&config(&second));
        if changed.before.mode != Mode::Fault {
            changed.before.mode = Mode::Off;
        }
        changed.take(&after);
    }
}

/// Any run keeps to the rules. They reach each mode, and each fault that a step can find.
#[test]
fn any_run_keeps_to_the_rules_and_the_runs_come_everywhere() {
    let all = RefCell::new(Seen::default());
    let inputs = (any_params(), prop::bool::weighted(0.9), any_inputs(200));
    let outcome = TestRunner::new(seeded(3 * CASES, SEED)).run(&inputs, |(params, tared, mut inputs)| {
        let mut run = Run::new(&params, tared);
        // Jog and strokes begin with a tip at rest, so it is in some of the runs.
        let rests = inputs.len().is_multiple_of(5);
        inputs.iter_mut().filter(|_| rests).for_each(|input| input.turn = Turn::By(0));
        run.take(&inputs);
        for (all, seen) in all.borrow_mut().iter_mut().zip(run.seen) {
            all.extend(seen);
        }
        Ok(())
    });
    outcome.expect("the rules hold");
    let [modes, faults, tasks, ends] = all.into_inner();
    assert_eq!(Vec::from_iter(modes), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(Vec::from_iter(tasks), [0, 1, 2, 3]);
    assert!([0, 1, 2, 3].iter().all(|number| ends.contains(number)), "{ends:?}");
    // Fault 1 is a repeated frame. The others are detected outside of the step.
    assert_eq!(Vec::from_iter(faults), [0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 14, 15]);
}
