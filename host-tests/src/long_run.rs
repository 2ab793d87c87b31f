//! Filters and integrators over 10^9 steps.
//!
//! Each is a machine with finitely many states. Under an input that repeats it must come to a state that it was in
//! before, and from then on it repeats itself for ever: finding that cycle proves what any number of steps would show.
//! A cycle of length 1 is rest. What is left to measure is how far the outputs swing within the cycle, which is the
//! limit cycle, and where they stand.

mod cases;
mod pipeline;

pub use cases::all;
pub use pipeline::hold;

/// Inputs that a run stands for.
pub const STEPS: u64 = 1_000_000_000;

/// How a machine ends.
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

/// What a run of a machine showed.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The machine and its input.
    pub name: String,
    /// Where it ends.
    pub cycle: Cycle,
    /// Inputs that were taken one by one.
    pub taken: u64,
    /// The name of each output, its swing within the cycle and the swing that is documented, in units of the last
    /// place.
    pub swings: Vec<(&'static str, i64, i64)>,
}

impl Outcome {
    /// Whether every output swings no more than documented.
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
    /// What it is, and under which input.
    pub name: String,
    /// Where it begins.
    pub start: S,
    /// How many inputs a period has.
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
    /// There is no cycle within `most` steps, or the steps end elsewhere; a machine that overflows panics by itself.
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
        // `begin` stands a whole number of cycles after the lead.
        let mut expected = begin.clone();
        (0..(steps - cycle.lead) % cycle.length).for_each(|_| (self.step)(&mut expected));
        assert!(state == expected, "{}: {steps} periods do not end in the cycle", self.name);
    }
}
