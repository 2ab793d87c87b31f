//! Filters and integrators over 10^9 steps.
//!
//! Each is a machine with finitely many states. Under an input that repeats it must come to a state that it was in
//! before, and from then on it repeats itself for ever: finding that cycle proves what any number of steps would show.
//! A cycle of length 1 is rest. What is left to measure is how far the outputs swing within the cycle, which is the
//! limit cycle, and where they stand.

mod cases;

pub use cases::all;

use crate::long_run::cases::cool;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};

/// Inputs that a run represents.
pub const STEPS: u64 = 1_000_000_000;

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
    /// End state.
    pub cycle: Cycle,
    /// Number of inputs that were applied one by one.
    pub taken: u64,
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
        write!(f, "{}: {kind} after {lead} periods, {} inputs taken;", self.name, self.taken)?;
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
    /// Start state.
    pub start: S,
    /// Number of inputs in a period.
    pub inputs: u64,
    /// One period of the input.
    pub step: Box<dyn Fn(&mut S) + Send>,
    /// The outputs, with the swing allowed in a cycle.
    pub outputs: Vec<Output<S>>,
}

/// An output's name, its value in units of the last place, and its documented swing.
pub type Output<S> = (&'static str, fn(&S) -> i64, i64);

impl<S: Clone + PartialEq + 'static> Machine<S> {
    /// Finds the cycle and measures it. With `whole`, all [`STEPS`] are also taken one by one, and must end
    /// where the cycle says.
    ///
    /// # Panics
    /// If there is no cycle within `most` steps, or the single steps end in another state. An overflow also panics.
    pub fn run(&self, most: u64, whole: bool) -> Outcome {
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
        let mut taken = (cycle.lead + 2 * cycle.length) * self.inputs;
        if whole {
            self.whole(&cycle, &begin);
            taken = STEPS;
        }
        let swings =
            self.outputs.iter().zip(ranges).map(|((name, _, allowed), (low, high))| (*name, high - low, *allowed));
        Outcome { name: self.name.clone(), cycle, taken, swings: swings.collect() }
    }

    fn whole(&self, cycle: &Cycle, begin: &S) {
        let mut state = self.start.clone();
        let steps = STEPS / self.inputs;
        (0..steps).for_each(|_| (self.step)(&mut state));
        // `begin` lies a whole number of cycles after the lead.
        let mut expected = begin.clone();
        (0..(steps - cycle.lead) % cycle.length).for_each(|_| (self.step)(&mut expected));
        assert!(state == expected, "{}: {steps} periods do not end in the cycle", self.name);
    }
}

/// The baseline visits a row of ten a frame, a refinement of the fit takes eleven frames, and a step of the winding's
/// model 256: the pipeline can repeat itself no sooner than after this many steps.
const PERIOD: u64 = 14_080;

/// The frame of a tip that presses, or not, in the middle of the array.
fn frame(codes: u16) -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..10).map(move |column| (slot, column))) {
        let pressed = (3..7).contains(&slot) && (3..7).contains(&column);
        let preload = if slot < ROWS { 40 } else { 0 };
        frame.set_code(slot, column, 372 + preload + if pressed { codes } else { 0 });
    }
    frame
}

/// Holds a goal with constant frames, the given codes on 16 taxels and a constant encoder count, until only the frame
/// number changes in the pipeline from period to period.
///
/// # Panics
/// If the state still changes after `most` steps.
pub fn hold(name: &str, torque: bool, goal_mn: i32, codes: u16, most: u64) -> (Outcome, Status) {
    let mut pipeline = Pipeline::new(&Config::shipped(&cool()).expect("the defaults are allowed"));
    let sense = Sense { supply_mv: 6_000, ..Sense::default() };
    let mut command = Command { tare_request: 1, ..Command::default() };
    let mut shown = frame(0);
    let step = |pipeline: &mut Pipeline, command: &Command, shown: &mut Frame| {
        shown.sequence = shown.sequence.wrapping_add(1);
        *pipeline.step(shown, &sense, command).1
    };
    for _ in 0..TARE_FRAMES + 2 {
        step(&mut pipeline, &command, &mut shown);
    }
    command.torque = torque;
    command.goal = newtons(goal_mn);
    let mut shown = Frame { sequence: shown.sequence, ..frame(codes) };

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
            return (Outcome { name: name.into(), cycle, taken, swings: vec![] }, status);
        }
        next *= 2;
    }
    panic!("{name}: still changes after {taken} steps")
}

/// Every field of the pipeline, but the frames' number.
fn state(pipeline: &Pipeline, sequence: u32) -> String {
    format!("{pipeline:?}").replacen(&format!("sequence: {sequence},"), "", 1)
}
