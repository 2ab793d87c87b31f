//! Modes, faults and limits over time: a row for each that occurred.

use fingertip::pipeline::Status;
use fingertip::state::{Fault, Limits, Mode};
use serde::Serialize;

/// Those that a mode, a fault or a limit has as a bit of its own: first bits of the three.
const FAULTS: u32 = 8;
const LIMITS: u32 = 32;

/// A row's name, in its bit's order from the first one.
const NAMES: [(u32, &str, &[&str]); 3] = [
    (0, "mode", &["off", "tare", "approach", "force", "release", "fault", "press", "strokes"]),
    (
        FAULTS,
        "fault",
        &[
            "",
            "lost frames",
            "array broken",
            "row stuck",
            "array frozen",
            "encoder frozen",
            "over force",
            "bus silent",
            "broken parameters",
            "supply low",
            "supply high",
            "bridge",
            "missed deadline",
            "crash",
            "runaway",
            "reversed",
            "unseen",
            "no clock",
            "brown-out level",
        ],
    ),
    (
        LIMITS,
        "limit",
        &[
            "voltage",
            "current",
            "speed",
            "goal",
            "travel",
            "taxels",
            "not tared",
            "frame missed",
            "slew",
            "fit level",
            "tared touching",
            "from below",
            "guard",
            "winding",
            "direction",
            "torque held",
        ],
    ),
];

/// What occurred in a stretch of time, a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct States(u64);

impl States {
    /// A step's.
    pub fn add(&mut self, status: &Status) {
        let Status { mode, fault, limits, .. } = *status;
        self.set(0, mode as u32);
        if let Some(fault) = fault {
            self.set(FAULTS, fault as u32);
        }
        self.0 |= u64::from(limits.0) << LIMITS;
    }

    fn set(&mut self, first: u32, number: u32) {
        self.0 |= 1 << (first + number);
    }
}

/// A mode, a fault or a limit that occurred.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// `mode`, `fault` or `limit`.
    pub kind: &'static str,
    /// Its name, or its number where it has none here.
    pub name: String,
    /// Stretches in which it occurred: from one to before another.
    pub spans: Vec<[usize; 2]>,
}

/// All of them: modes, faults, limits, each in the order of their numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Strip(pub Vec<Row>);

impl Strip {
    /// Of stretch after stretch.
    pub fn of(states: &[States]) -> Self {
        let row = |bit: u32| {
            let spans = spans(states, bit);
            let (first, kind, names) = NAMES.into_iter().rfind(|(first, ..)| *first <= bit)?;
            let number = bit - first;
            let name = names.get(number as usize).filter(|name| !name.is_empty());
            let name = name.map_or_else(|| number.to_string(), |name| (*name).to_owned());
            (!spans.is_empty()).then_some(Row { kind, name, spans })
        };
        Self((0..u64::BITS).filter_map(row).collect())
    }
}

fn spans(states: &[States], bit: u32) -> Vec<[usize; 2]> {
    let mut spans: Vec<[usize; 2]> = Vec::new();
    for at in (0..states.len()).filter(|at| states[*at].0 >> bit & 1 == 1) {
        match spans.last_mut() {
            Some([_, end]) if *end == at => *end = at + 1,
            _ => spans.push([at, at + 1]),
        }
    }
    spans
}

// A new mode or fault must not run into the next one's bits.
const _: () = assert!(Mode::ALL.len() as u32 <= FAULTS && FAULTS + (Fault::ALL.len() as u32) < LIMITS);
const _: () = assert!(NAMES[0].2.len() == Mode::ALL.len() && NAMES[1].2.len() == 1 + Fault::ALL.len());
const _: () = assert!(Limits::TORQUE_HELD == 1 << 15);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_occurred_in_a_stretch_is_kept_however_short_it_was() {
        let mut states = [States::default(); 5];
        let status = |mode, fault, limits| Status { mode, fault, limits: Limits(limits), ..Status::default() };
        states[0].add(&status(Mode::Approach, None, 0));
        states[1].add(&status(Mode::Approach, None, Limits::GUARD));
        states[1].add(&status(Mode::Force, None, 0));
        states[2].add(&status(Mode::Force, None, Limits::VOLTAGE));
        states[3].add(&status(Mode::Fault, Some(Fault::Unseen), 0));
        states[4].add(&status(Mode::Approach, None, Limits::TORQUE_HELD));
        let row = |kind, name: &str, spans: &[[usize; 2]]| Row { kind, name: name.into(), spans: spans.to_vec() };
        assert_eq!(
            Strip::of(&states).0,
            [
                row("mode", "approach", &[[0, 2], [4, 5]]),
                row("mode", "force", &[[1, 3]]),
                row("mode", "fault", &[[3, 4]]),
                row("fault", "unseen", &[[3, 4]]),
                row("limit", "voltage", &[[2, 3]]),
                row("limit", "guard", &[[1, 2]]),
                row("limit", "torque held", &[[4, 5]]),
            ]
        );
    }
}
