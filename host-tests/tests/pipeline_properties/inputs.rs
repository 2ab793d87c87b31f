//! What a step may be given: frames, senses and commands, likely ones and any others.

use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use fingertip::units::Newtons;
use proptest::prelude::*;

/// What the columns show with nothing driven, and the preload above it.
const UNDRIVEN: u16 = 372;
const PRELOAD: u16 = 40;

/// A frame.
#[derive(Clone, Debug)]
pub enum Codes {
    /// A sound array, with so many codes more on the taxels around a place.
    Contact { row: usize, column: usize, codes: u16 },
    /// A sound array but for one code.
    Odd { slot: usize, column: usize, code: u16 },
    /// All alike.
    Flat(u16),
    /// Two codes in turns.
    Checkerboard(u16, u16),
    /// Two codes by row: what a scan out of step shows.
    Stripes(u16, u16),
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
                    Self::Checkerboard(even, odd) => {
                        if (slot + column) % 2 == 0 {
                            even
                        } else {
                            odd
                        }
                    }
                    Self::Stripes(even, odd) => {
                        if slot % 2 == 0 {
                            even
                        } else {
                            odd
                        }
                    }
                    Self::Noise(_) => random.u16(..),
                };
            frame.set_code(slot, column, code);
        }
    }
}

/// How the encoder moved.
#[derive(Clone, Debug)]
pub enum Turn {
    By(i32),
    To(i32),
}

/// What changes from a step to the next.
#[derive(Clone, Debug)]
pub struct Input {
    pub codes: Codes,
    /// Sequence numbers left out.
    pub missed: u32,
    pub turn: Turn,
    pub supply_mv: u16,
    pub bus_silent_ms: u16,
    pub bridge_fault: bool,
    pub torque: bool,
    pub goal_bits: i32,
    pub bus_watchdog_ms: u16,
    /// Added to the numbers of the requests: tare, clear, measure.
    pub requests: [u8; 3],
}

/// The arguments of a step.
#[derive(Clone, Debug)]
pub struct Arguments {
    pub frame: Frame,
    pub sense: Sense,
    pub command: Command,
}

impl Arguments {
    pub fn new() -> Self {
        let mut frame = Frame::EMPTY;
        Codes::Contact { row: 0, column: 0, codes: 0 }.fill(&mut frame);
        let sense = Sense { supply_mv: 6_000, ..Sense::default() };
        Self { frame, sense, command: Command::default() }
    }

    pub fn next(&mut self, input: &Input) {
        input.codes.fill(&mut self.frame);
        self.frame.sequence = self.frame.sequence.wrapping_add(1).wrapping_add(input.missed);
        let sense = &mut self.sense;
        sense.encoder = match input.turn {
            Turn::By(counts) => sense.encoder.wrapping_add(counts),
            Turn::To(count) => count,
        };
        sense.supply_mv = input.supply_mv;
        sense.bus_silent_ms = input.bus_silent_ms;
        sense.bridge_fault = input.bridge_fault;
        let command = &mut self.command;
        command.torque = input.torque;
        command.goal = Newtons::from_bits(input.goal_bits);
        command.bus_watchdog_ms = input.bus_watchdog_ms;
        let [tare, clear, measure] = input.requests;
        command.tare_request = command.tare_request.wrapping_add(tare);
        // One of four tares is forced.
        command.tare_forced = command.tare_request.is_multiple_of(4);
        command.clear_request = command.clear_request.wrapping_add(clear);
        // Its lowest bits name a task.
        command.measure_request = command.measure_request.wrapping_add(measure);
    }
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
        1 => (code(), code()).prop_map(|(even, odd)| Codes::Checkerboard(even, odd)),
        1 => (code(), code()).prop_map(|(even, odd)| Codes::Stripes(even, odd)),
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

fn requests() -> impl Strategy<Value = [u8; 3]> {
    [
        // Each takes the motor away for many frames.
        prop_oneof![400 => Just(0), 1 => any::<u8>()],
        prop_oneof![5 => Just(0), 1 => any::<u8>()],
        prop_oneof![
            10 => Just(0),
            1 => any::<u8>()
        ],
    ]
}

/// Any input; sound ones more often, so that the loop also gets somewhere.
pub fn any_input() -> impl Strategy<Value = Input> {
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
            let (torque, goal_bits, bus_watchdog_ms, requests) = command;
            Input {
                codes,
                missed,
                turn,
                supply_mv,
                bus_silent_ms,
                bridge_fault,
                torque,
                goal_bits,
                bus_watchdog_ms,
                requests,
            }
        },
    )
}

/// A run of inputs.
pub fn any_inputs(most: usize) -> impl Strategy<Value = Vec<Input>> {
    // Held inputs let the integrators run up; changing ones jerk them.
    let held = (any_input(), 1..400_usize).prop_map(|(input, times)| vec![input; times]);
    prop_oneof![
        prop::collection::vec(any_input(), 1..most),
        prop::collection::vec(held, 1..6).prop_map(|runs| runs.concat()),
    ]
}
