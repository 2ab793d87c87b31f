//! Data of a report, collected during the run: a bounded number of stretches at any length of the run, and the modes,
//! faults and limits that occurred.

use crate::metrics::{duty, newtons};
use crate::watch::{Path, Step, Watch};
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, ROWS};
use fingertip::state::{Fault, Limits, Mode};
use fingertip::units::Newtons;
use output::plot::Pressures;
use serde::Serialize;

/// Number of stretches of time. Each keeps the least, the largest and the mean value.
const STRETCHES: u64 = 900;
/// Number of stretches over which a noisy quantity is averaged.
const OF_A_MEAN: usize = 9;
/// Time after which the steady error is judged, as in the metric `steady_error_max_mn`.
const HELD_AFTER_S: f64 = 0.1;
/// Pressure maps of a run.
const MAPS: usize = 150;

#[derive(Clone, Copy, Debug)]
struct Stretch {
    number: u64,
    low: f64,
    high: f64,
    last: f64,
    sum: f64,
    count: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Track(Vec<Stretch>);

/// Values of a quantity in a stretch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    pub low: f64,
    pub high: f64,
    pub mean: f64,
    pub last: f64,
}

impl Track {
    fn add(&mut self, number: u64, value: f64) {
        match self.0.last_mut() {
            Some(last) if last.number == number => {
                last.low = last.low.min(value);
                last.high = last.high.max(value);
                last.last = value;
                last.sum += value;
                last.count += 1.0;
            }
            _ => self.0.push(Stretch { number, low: value, high: value, last: value, sum: value, count: 1.0 }),
        }
    }

    /// Returns the values in each stretch of another track; none where this one has none.
    pub fn along(&self, other: &Self) -> Vec<Option<Kept>> {
        let at = |number| self.0.binary_search_by_key(&number, |stretch| stretch.number).ok().map(|at| self.0[at]);
        let kept = |stretch: Stretch| {
            let Stretch { low, high, last, sum, count, .. } = stretch;
            Kept { low, high, mean: sum / count, last }
        };
        other.0.iter().map(|stretch| at(stretch.number).map(kept)).collect()
    }

    pub fn means(&self) -> Vec<f64> {
        self.0.iter().map(|stretch| stretch.sum / stretch.count).collect()
    }

    /// Mean over several stretches around each; at the ends over the same number.
    pub fn smooth(&self) -> Vec<f64> {
        let all = self.0.len();
        let wide = OF_A_MEAN.min(all);
        let mean = |at: usize| {
            let from = at.saturating_sub(wide / 2).min(all - wide);
            let (sum, count) = self.0[from..from + wide]
                .iter()
                .fold((0.0, 0.0), |(s, c), stretch| (s + stretch.sum, c + stretch.count));
            sum / count
        };
        (0..all).map(mean).collect()
    }

    /// Least and largest value; none if it is empty.
    pub fn ends(&self) -> Option<[f64; 2]> {
        let wider = |[low, high]: [f64; 2], at: &Stretch| [low.min(at.low), high.max(at.high)];
        self.0.first().map(|first| self.0.iter().fold([first.low, first.high], wider))
    }

    pub fn moves(&self) -> bool {
        self.ends().is_some_and(|[low, high]| low < high)
    }
}

#[derive(Clone, Debug)]
pub struct Instant {
    pub time_s: f64,
    pub true_kpa: Pressures,
    /// Codes of the taxels, less those of the first frame of the scene.
    pub codes: [[i32; COLUMNS]; ROWS],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawn {
    Plain,
    /// With a mean over several stretches.
    Smooth,
    /// Only if it has different values.
    IfItMoves,
}

/// Quantity with a plot of its own: title, unit, way of drawing, and value.
type Quantity = (&'static str, &'static str, Drawn, fn(&Step) -> f64);

/// Quantities with plots of their own, in the order of the plots.
pub const QUANTITIES: [Quantity; 8] = [
    ("Sensed less the true force", "mN", Drawn::Plain, |s| 1e3 * (newtons(s.status.contact.force) - s.truth.force_n)),
    ("Indentation of the tip", "mm", Drawn::Plain, |s| s.truth.indentation_mm),
    ("Duty of the bridge", "%", Drawn::Smooth, |s| 100.0 * duty(s.status.duty)),
    ("Current in the winding", "A", Drawn::Smooth, |s| s.truth.current_a),
    ("Supply at the bridge", "V", Drawn::IfItMoves, |s| s.truth.supply_v),
    ("Temperature of the winding", "C", Drawn::IfItMoves, |s| s.truth.winding_c),
    ("Slip of the contact", "mm", Drawn::IfItMoves, |s| s.truth.slip_mm),
    ("Height of the object", "mm", Drawn::IfItMoves, |s| s.truth.object_mm[1]),
];

#[derive(Clone, Debug, Default)]
pub struct Tracks {
    /// Time, s.
    pub time: Track,
    /// Requested force, N.
    pub goal: Track,
    /// The true force, N.
    pub force: Track,
    /// The sensed force, N.
    pub sensed: Track,
    /// The true force less the goal, mN.
    pub control_error: Track,
    /// The control error while a force is held, `HELD_AFTER_S` after the goal changed or the touch.
    pub held_error: Track,
    /// Tracks of the quantities with plots of their own.
    pub quantities: [Track; QUANTITIES.len()],
    /// True force, N, and travel, mm, less those of the other board, if there is one.
    pub differences: [Track; 2],
    pub instants: Vec<Instant>,
    /// Modes, faults and limits that occurred in each stretch of `time`, a bit each.
    pub states: Vec<u64>,
    first: Option<Frame>,
    /// Mode and goal, and the time of their last change.
    asked: (Mode, Newtons),
    asked_s: f64,
}

#[derive(Clone, Debug)]
pub struct Trace {
    duration_s: f64,
    /// Path of another board, if the difference from it is drawn too.
    pub other: Option<Path>,
    pub fingers: Vec<Tracks>,
}

impl Trace {
    pub fn new(duration_s: f64) -> Self {
        Self { duration_s, other: None, fingers: Vec::new() }
    }

    fn map_is_due(&self, finger: usize, time_s: f64) -> bool {
        let taken = self.fingers.get(finger).map_or(0, |tracks| tracks.instants.len());
        taken < MAPS && time_s >= self.duration_s * taken as f64 / MAPS as f64
    }

    /// Stretch of a time. The last one includes later times.
    fn stretch(&self, time_s: f64) -> u64 {
        let share = if self.duration_s > 0.0 { time_s / self.duration_s } else { 0.0 };
        ((STRETCHES as f64 * share) as u64).min(STRETCHES - 1)
    }
}

impl Watch for Trace {
    fn wants_pressures(&mut self, finger: usize, time_s: f64) -> bool {
        time_s >= 0.0 && self.map_is_due(finger, time_s)
    }

    fn step(&mut self, step: &Step) {
        let Step { time_s, truth, status, .. } = *step;
        if time_s < 0.0 {
            return;
        }
        let due = self.map_is_due(step.finger, time_s);
        let stretch = self.stretch(time_s);
        if self.fingers.len() <= step.finger {
            self.fingers.resize_with(step.finger + 1, Tracks::default);
        }
        let tracks = &mut self.fingers[step.finger];
        let goal_n = newtons(step.command.goal);
        tracks.goal.add(stretch, goal_n);
        tracks.force.add(stretch, truth.force_n);
        tracks.sensed.add(stretch, newtons(status.contact.force));
        tracks.control_error.add(stretch, 1e3 * (truth.force_n - goal_n));
        tracks.time.add(stretch, time_s);
        for (track, (.., value)) in tracks.quantities.iter_mut().zip(QUANTITIES) {
            track.add(stretch, value(step));
        }
        let asked = (status.mode, step.command.goal);
        if tracks.asked != asked {
            (tracks.asked, tracks.asked_s) = (asked, time_s);
        }
        if status.mode == Mode::Force && time_s >= tracks.asked_s + HELD_AFTER_S {
            tracks.held_error.add(stretch, 1e3 * (truth.force_n - goal_n));
        }
        if let Some(differences) = self.other.as_ref().and_then(|other| other.difference(step)) {
            tracks.differences.iter_mut().zip(differences).for_each(|(track, value)| track.add(stretch, value));
        }
        tracks.states.resize(tracks.time.0.len(), 0);
        if let Some(states) = tracks.states.last_mut() {
            *states |= bits(status);
        }
        if due {
            let first = *tracks.first.get_or_insert(*step.frame);
            let code = |row, column| i32::from(step.frame.code(row, column)) - i32::from(first.code(row, column));
            let codes = core::array::from_fn(|row| core::array::from_fn(|column| code(row, column)));
            tracks.instants.push(Instant { time_s, true_kpa: truth.pressures_kpa, codes });
        }
    }
}

/// First bits of faults and limits; modes begin at bit 0.
const FAULTS: u32 = 8;
const LIMITS: u32 = 32;

/// First bit of modes, faults and limits, and their names in the order of the bits.
#[rustfmt::skip]
const NAMES: [(u32, &str, &[&str]); 3] = [
    (0, "mode", &["off", "tare", "approach", "force", "release", "fault", "press", "strokes"]),
    (FAULTS, "fault", &[
        "", "lost frames", "array broken", "row stuck", "array frozen", "encoder frozen", "over force",
        "bus silent", "broken parameters", "supply low", "supply high", "bridge", "missed deadline", "crash",
        "runaway", "reversed", "unseen", "no clock", "brown-out level",
    ]),
    (LIMITS, "limit", &[
        "voltage", "current", "speed", "goal", "travel", "taxels", "not tared", "frame missed", "slew", "fit level",
        "tared touching", "from below", "guard", "winding", "direction", "torque held",
    ]),
];

fn bits(&Status { mode, fault, limits, .. }: &Status) -> u64 {
    let fault = fault.map_or(0, |fault| 1 << (FAULTS + fault as u32));
    1 << mode as u32 | fault | u64::from(limits.0) << LIMITS
}

/// A mode, a fault or a limit that occurred.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Row {
    /// `mode`, `fault` or `limit`.
    pub kind: &'static str,
    /// Name, or number without a name.
    pub name: String,
    /// Stretches in which it occurred, each range without its end.
    pub spans: Vec<[usize; 2]>,
}

/// Modes, faults and limits that occurred, each in the order of their numbers.
pub fn rows(states: &[u64]) -> Vec<Row> {
    let row = |bit: u32| {
        let spans = spans(states, bit);
        let (first, kind, names) = NAMES.into_iter().rfind(|(first, ..)| *first <= bit)?;
        let number = bit - first;
        let name = names.get(number as usize).filter(|name| !name.is_empty());
        let name = name.map_or_else(|| number.to_string(), |name| (*name).to_owned());
        (!spans.is_empty()).then_some(Row { kind, name, spans })
    };
    (0..u64::BITS).filter_map(row).collect()
}

fn spans(states: &[u64], bit: u32) -> Vec<[usize; 2]> {
    let mut spans: Vec<[usize; 2]> = Vec::new();
    for at in (0..states.len()).filter(|at| states[*at] >> bit & 1 == 1) {
        match spans.last_mut() {
            Some([_, end]) if *end == at => *end = at + 1,
            _ => spans.push([at, at + 1]),
        }
    }
    spans
}

// The bits of modes, faults and limits must not overlap.
const _: () = assert!(Mode::ALL.len() as u32 <= FAULTS && FAULTS + (Fault::ALL.len() as u32) < LIMITS);
const _: () = assert!(NAMES[0].2.len() == Mode::ALL.len() && NAMES[1].2.len() == 1 + Fault::ALL.len());
const _: () = assert!(Limits::TORQUE_HELD == 1 << 15);

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: impl IntoIterator<Item = (u64, f64)>) -> Track {
        let mut track = Track::default();
        values.into_iter().for_each(|(stretch, value)| track.add(stretch, value));
        track
    }

    #[test]
    fn a_track_keeps_each_spike_and_the_order() {
        let value = |n: u64| if n == 7_777 { 5.0 } else { (n % 3) as f64 };
        let track = of((0..10_000).map(|n| (n / 100, value(n))));
        let time = of((0..10_000).map(|n| (n / 100, n as f64)));
        let kept = track.along(&time);
        assert_eq!(kept.len(), 100);
        for (n, kept) in kept.iter().enumerate() {
            let Kept { low, high, .. } = kept.unwrap();
            assert_eq!([low, high], [0.0, if n == 77 { 5.0 } else { 2.0 }], "{n}");
        }
        assert!(time.means().is_sorted());
    }

    #[test]
    fn what_comes_at_the_very_end_is_no_stretch_of_its_own() {
        let trace = Trace::new(0.9);
        assert_eq!([0.0, 0.8999, 0.9, 1.0].map(|time_s| trace.stretch(time_s)), [0, 899, 899, 899]);
    }

    #[test]
    fn a_mean_at_an_end_is_over_as_many_values_as_any_other() {
        // 10 and -10 in turn; 100 is the last.
        let track = of((0..900).map(|n| (n, if n == 899 { 100.0 } else { [10.0, -10.0][n as usize % 2] })));
        let smooth = track.smooth();
        assert_eq!(smooth.len(), 900);
        assert!(smooth[..895].iter().all(|mean| mean.abs() < 1.2), "{smooth:?}");
        assert!(smooth[895..].iter().all(|mean| (mean - 100.0 / 9.0).abs() < 1e-9), "{:?}", &smooth[890..]);
        assert_eq!(of([(0, 1.0), (1, 3.0)]).smooth(), [2.0, 2.0]);
        assert!(of([]).smooth().is_empty());
    }

    #[test]
    fn a_track_that_begins_later_has_nothing_before() {
        let kept = of([(2, 1.0), (2, 3.0)]).along(&of([(0, 0.0), (2, 0.2)]));
        assert_eq!(kept, [None, Some(Kept { low: 1.0, high: 3.0, mean: 2.0, last: 3.0 })]);
        assert!(!of([(0, 1.0), (1, 1.0)]).moves() && of([(0, 1.0), (0, 2.0)]).moves());
    }

    #[test]
    fn what_occurred_in_a_stretch_is_kept_however_short_it_was() {
        let mut states = [0; 5];
        let status = |mode, fault, limits| Status { mode, fault, limits: Limits(limits), ..Status::default() };
        states[0] |= bits(&status(Mode::Approach, None, 0));
        states[1] |= bits(&status(Mode::Approach, None, Limits::GUARD));
        states[1] |= bits(&status(Mode::Force, None, 0));
        states[2] |= bits(&status(Mode::Force, None, Limits::VOLTAGE));
        states[3] |= bits(&status(Mode::Fault, Some(Fault::Unseen), 0));
        states[4] |= bits(&status(Mode::Approach, None, Limits::TORQUE_HELD));
        let row = |kind, name: &str, spans: &[[usize; 2]]| Row { kind, name: name.into(), spans: spans.to_vec() };
        assert_eq!(
            rows(&states),
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
