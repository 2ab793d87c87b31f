//! Properties of the pipeline for any frame, any sense and any command, in any order, under any parameters allowed.
//!
//! The tests run with overflow checks, so "does not panic" includes "does not overflow".

mod steps;

use crate::common::*;
use fingertip::config::{ConfigError, Gains};

/// The same cases on every run.
fn fixed(cases: u32) -> ProptestConfig {
    seeded(cases, 20_030_914)
}

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
    /// All alike.
    Flat(u16),
    /// Two codes in turns.
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
                    Self::Flat(code) => code,
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

/// The arguments of the first step.
fn at_rest() -> Record {
    let mut frame = Frame::EMPTY;
    Codes::Contact { row: 0, column: 0, codes: 0 }.fill(&mut frame);
    Record { frame, sense: Sense { supply_mv: 6_000, ..Sense::default() }, command: Command::default() }
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
        1 => code().prop_map(Codes::Flat),
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

/// Numbers added to those of the requests: tare, clear, measure.
fn requests() -> impl Strategy<Value = [u8; 3]> {
    // A tare takes the motor away for many frames.
    [400, 5, 10].map(|none| prop_oneof![none => Just(0), 1 => any::<u8>()])
}

/// Any input; sound ones more often, so that the loop also gets somewhere.
fn any_input() -> impl Strategy<Value = Input> {
    let sense = (
        turn(),
        prop_oneof![20 => 5_500..7_000_u16, 1 => Just(0), 1 => Just(u16::MAX), 1 => any::<u16>()],
        prop_oneof![10 => Just(0), 1 => any::<u16>()],
        prop::bool::weighted(0.005),
    );
    let command = (
        prop::bool::weighted(0.9),
        prop_oneof![10 => 0..9 << 16, 2 => Just(0), 1 => Just(i32::MIN), 1 => Just(i32::MAX), 1 => any::<i32>()],
        prop_oneof![10 => Just(0), 1 => any::<u16>()],
        requests(),
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
    prop_oneof![Just(Place::Least), Just(Place::Largest), Just(Place::Default), (0.0..=1.0).prop_map(Place::Between),]
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

proptest! {
    #![proptest_config(self::fixed(4_000))]

    #[test]
    fn any_allowed_parameters_make_a_configuration(params in any_params()) {
        config(&params);
    }
}
