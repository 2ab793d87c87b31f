//! Random sequences of requests and of motions of the object, judged by the true force and the table of modes.
//!
//! The first sequences that fail are printed. The core checks its arithmetic for overflow.

use crate::*;
use fingertip::command::Command;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The usual number of sequences: about 20 s of one core.
const USUAL: u64 = 600;

/// An object that is taken away is this far off.
const AWAY_MM: f64 = 100.0;

/// A finger during a sequence of events, and the values that are judged.
struct Run<'a> {
    finger: Finger,
    sequence: &'a Sequence,
    forces: Forces,
    object_mm: f64,
    before: Mode,
    broken: Option<String>,
}

impl Run<'_> {
    fn frame(&mut self, approaching: bool) {
        let (time_s, command) = (self.finger.time_s(), *self.finger.command());
        let force_n = self.finger.truth().force_n;
        let now = self.finger.status().mode;
        self.forces.observe(time_s, force_n, &command, now, approaching);
        let broken = self.forces.broken(force_n).or_else(|| check_mode(self.before, now, &command));
        if let (None, Some(reason)) = (&self.broken, broken) {
            self.broken = Some(format!("{time_s:.4} s, {now:?} {:?}: {reason}", self.finger.status().fault));
        }
        self.before = now;
    }

    fn wait(&mut self, seconds: f64) {
        let until_s = self.finger.time_s() + seconds;
        while self.finger.time_s() < until_s {
            self.finger.step();
            self.frame(false);
        }
    }

    fn happens(&mut self, event: Event) {
        let command = self.finger.command();
        let add = |request: &mut u8| *request = request.wrapping_add(1);
        match event {
            Event::Goal(goal_n) => set_goal(&mut self.finger, goal_n),
            Event::Torque(on) => command.torque = on,
            Event::Tare => add(&mut command.tare_request),
            Event::Clear => add(&mut command.clear_request),
            Event::Measure(task) => command.measure_request = task.after(command.measure_request),
            Event::Move { by_mm, mm_per_s } if self.object_mm < AWAY_MM => self.carry(by_mm, mm_per_s),
            Event::Remove => self.place(AWAY_MM),
            // In front of the present place of the tip.
            Event::PutBack => {
                let clear_mm = self.finger.truth().travel_mm + 0.5;
                self.place(self.sequence.distance_mm.max(clear_mm));
            }
            Event::Move { .. } | Event::Wait => {}
        }
    }

    fn place(&mut self, distance_mm: f64) {
        self.object_mm = distance_mm;
        self.finger.place_object(distance_mm);
    }

    fn carry(&mut self, by_mm: f64, mm_per_s: f64) {
        let from_mm = self.object_mm;
        // Frames of about 0.1 ms.
        let frames = (by_mm.abs() / mm_per_s * 1e4).ceil() as u32;
        for frame in 1..=frames {
            self.place(from_mm + by_mm * f64::from(frame) / f64::from(frames));
            self.finger.step();
            self.frame(by_mm < 0.0);
        }
    }

    /// The stop promise: some time after the last event, which ends pressing, nothing is pressed any more.
    fn end(&mut self) {
        // The last event is acknowledged in the next frame; a press that measures ends by itself.
        self.wait(0.002);
        let until_s = self.finger.time_s() + 10.0;
        while self.finger.status().mode == Mode::Press && self.finger.time_s() < until_s {
            self.wait(0.1);
        }
        let (stop_s, held_n) = self.sequence.stops(drives(self.finger.status().mode));
        self.wait(stop_s);
        let left_n = self.finger.truth().force_n;
        if left_n > CONTACT_ON_N + held_n && self.forces.pushed_n == 0.0 {
            let reason = format!("{left_n:.3} N are left {stop_s} s after the end, {held_n:.3} N allowed for friction");
            let state = format!("{:?} {:?}", self.finger.status().mode, self.finger.status().fault);
            self.broken.get_or_insert(format!("at the end, {state}: {reason}"));
        }
    }
}

/// Lets a sequence happen; returns the first rule that it broke.
fn broken(sequence: &Sequence) -> Option<String> {
    let run = || {
        let mut finger = finger(&sequence.tables);
        finger.command().torque = false;
        let (object_mm, before) = (sequence.distance_mm, finger.status().mode);
        let mut run = Run { finger, sequence, forces: Forces::default(), object_mm, before, broken: None };
        for (after_s, event) in &sequence.events {
            run.wait(*after_s);
            run.happens(*event);
        }
        run.end();
        run.broken
    };
    // Whoever panics says so on standard error as well.
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| Some("a panic".into()))
}

sim::sizes!(
    random_sequences_keep_the_force_in_bounds_and_the_table_of_modes,
    keep_the_rules(0..USUAL / 15),
    keep_the_rules(USUAL / 15..USUAL)
);

fn keep_the_rules(seeds: Range<u64>) {
    let count = seeds.end - seeds.start;
    let failed = cores::map(seeds, |seed| broken(&Sequence::drawn(seed)).map(|reason| (seed, reason)));
    let failed: Vec<_> = failed.into_iter().flatten().collect();
    let shown = failed.iter().take(6).map(|(seed, reason)| format!("{seed}: {reason}\n{:?}\n", Sequence::drawn(*seed)));
    let shown: String = shown.collect();
    assert!(failed.is_empty(), "{} of {count} sequences break a rule, such as\n{}", failed.len(), shown);
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A goal, N.
    Goal(f64),
    Torque(bool),
    Tare,
    Clear,
    Measure(Task),
    /// The object's surface moves, towards the tip where `by_mm` is below 0.
    Move {
        by_mm: f64,
        mm_per_s: f64,
    },
    /// The object is taken away.
    Remove,
    /// The object is put in its place again, or in front of the tip.
    PutBack,
    Wait,
}

impl Event {
    fn drawn(rng: &mut Rng) -> Self {
        match rng.u32(0..24) {
            0..6 => Self::Goal(log_uniform(rng, 0.2, 7.0)),
            6..9 => Self::Goal(0.0),
            9..11 => Self::Torque(false),
            11..15 => Self::Torque(true),
            15 => Self::Tare,
            16 => Self::Clear,
            17..19 => Self::Measure(Task::Press),
            19 => Self::Measure(rng.choice([Task::Jog, Task::Strokes]).expect("there are two")),
            20..22 => Self::Move { by_mm: uniform(rng, -2.0, 2.0), mm_per_s: uniform(rng, 5.0, 60.0) },
            22 => Self::Remove,
            _ => rng.choice([Self::PutBack, Self::Wait]).expect("there are two"),
        }
    }
}

/// A finger, and events with the delay of each after the one before, s.
#[derive(Debug)]
struct Sequence {
    tables: String,
    distance_mm: f64,
    yield_mm_per_n: f64,
    friction_mnm: f64,
    events: Vec<(f64, Event)>,
}

impl Sequence {
    /// The sequence of a number.
    fn drawn(seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let count = rng.usize(4..=12);
        let mut events = Vec::new();
        // The drive is measured with torque off; all else needs torque.
        if rng.u32(0..4) != 0 {
            events.extend([(0.001, Event::Torque(true)), (0.001, Event::Goal(log_uniform(&mut rng, 0.2, 7.0)))]);
        }
        events.extend((0..count).map(|_| (log_uniform(&mut rng, 0.001, 0.4), Event::drawn(&mut rng))));
        let after_s = log_uniform(&mut rng, 0.001, 0.4);
        events.push((after_s, if rng.bool() { Event::Goal(0.0) } else { Event::Torque(false) }));
        let distance_mm = uniform(&mut rng, 1.0, 5.0);
        let yield_mm_per_n = if rng.bool() { 0.0 } else { log_uniform(&mut rng, 0.1, 2.0) };
        let modulus_kpa = log_uniform(&mut rng, 150.0, 400.0);
        let friction_mnm = uniform(&mut rng, 0.0, 0.25);
        let tables = format!(
            "seed = {seed}\n[controller]\ndirection_confirmed = 1\n[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}\
            [effects.dry_friction]\ntorque_mnm = {friction_mnm:?}\n{}",
            object(distance_mm, yield_mm_per_n),
            if rng.bool() { "[effects.noise]\nrms_codes = 1.5\n" } else { "" }
        );
        Self { tables, distance_mm, yield_mm_per_n, friction_mnm, events }
    }

    /// Time within which pressing ends, and the force that friction may hold without voltage. A driven release of a very
    /// soft object takes longer, and so does a release by a shorted motor.
    fn stops(&self, driven: bool) -> (f64, f64) {
        let soft = self.yield_mm_per_n > 1.0;
        if driven {
            return (if soft { 0.8 } else { 0.5 }, 0.0);
        }
        // The drum of 12 mm behind 43:1.
        (if soft { 1.5 } else { 1.0 }, 0.05 + self.friction_mnm * 43.0 / 12.0)
    }
}

/// A goal that is taken back counts for this long.
const RECENT_S: f64 = 0.2;

/// The largest force of a press that measures.
const MEASURING_N: f64 = Params::DEFAULT.force_max_mn as f64 * 1e-3;

/// The largest force allowed, frame by frame.
#[derive(Default)]
struct Forces {
    /// Goals that are over, and until when they were in force.
    goals: VecDeque<(f64, f64)>,
    goal_n: f64,
    /// Largest force since the object last moved towards the tip and is still touched; 0 otherwise.
    pushed_n: f64,
    pushed_s: f64,
    /// Force at the moment at which driving ended; friction may hold it.
    left_n: f64,
    driven: bool,
}

impl Forces {
    /// Takes in a frame. `approaching`: the object moves towards the tip.
    fn observe(&mut self, time_s: f64, force_n: f64, command: &Command, mode: Mode, approaching: bool) {
        let driven = drives(mode);
        let goal_n = match mode {
            Mode::Press => MEASURING_N,
            _ if driven => command.goal.0.to_num(),
            _ => 0.0,
        };
        if goal_n != self.goal_n {
            self.goals.push_back((time_s, self.goal_n));
            self.goal_n = goal_n;
        }
        self.goals.retain(|(until_s, _)| *until_s + RECENT_S > time_s);
        if !driven && (self.driven || self.left_n > 0.0 && !self.goals.is_empty()) {
            // The tip may still move for as long as the goal counts.
            self.left_n = self.left_n.max(force_n);
        } else if driven || force_n < CONTACT_ON_N {
            self.left_n = 0.0;
        }
        // Driving that begins on a contact may need the time of a goal that is taken back.
        if driven && !self.driven {
            self.goals.push_back((time_s, force_n));
        }
        self.driven = driven;
        // A force that the object causes counts until nothing is touched, or the loop has had time to correct it.
        if approaching && force_n > 0.0 {
            (self.pushed_n, self.pushed_s) = (self.pushed_n.max(force_n), time_s);
        } else if force_n < CONTACT_ON_N || mode == Mode::Force && time_s > self.pushed_s + 0.3 {
            self.pushed_n = 0.0;
        } else if self.pushed_n > 0.0 && time_s < self.pushed_s + 0.05 {
            self.pushed_n = self.pushed_n.max(force_n);
        }
    }

    /// Returns a reason if the force is too large.
    fn broken(&self, force_n: f64) -> Option<String> {
        let goal_n = self.goals.iter().map(|(_, goal_n)| *goal_n).fold(self.goal_n, f64::max);
        let most_n = most_n(goal_n).max(self.left_n + 0.05).max(1.05 * self.pushed_n + 0.05);
        (force_n > most_n).then(|| format!("{force_n:.3} N, {most_n:.3} N allowed for a goal of {goal_n:.3} N"))
    }
}

/// Returns true if a mode drives the motor for a goal or a measurement, so that torque off ends it.
fn drives(mode: Mode) -> bool {
    matches!(mode, Mode::Approach | Mode::Force | Mode::Release | Mode::Press)
}

/// Returns a reason if the table of modes in `src/state.rs` does not allow a change.
fn check_mode(before: Mode, now: Mode, command: &Command) -> Option<String> {
    let allowed = match (before, now) {
        (before, now) if before == now => true,
        (_, Mode::Fault | Mode::Tare) => before != Mode::Fault || now != Mode::Tare || !command.torque,
        (Mode::Fault, _) => now == Mode::Off && !command.torque,
        (Mode::Tare, _) => now == Mode::Off,
        (Mode::Off, _) => command.torque || now == Mode::Strokes,
        (Mode::Strokes, _) => now == Mode::Off,
        (Mode::Force, Mode::Off) | (Mode::Approach | Mode::Release | Mode::Press, Mode::Off) => !command.torque,
        (_, Mode::Strokes) => false,
        _ => true,
    };
    if !command.torque && drives(now) {
        return Some(format!("torque is off in {now:?}"));
    }
    (!allowed).then(|| format!("{before:?} to {now:?} is not in the table of modes"))
}

// One event at each of many instants of a press: torque off, goal 0, a fault of the bridge, a lost signal, a silent bus.
// Every 100th of the 500 instants of each press is tried, every 20th by `cargo xtask test --long`, and all by
// `INSTANTS_STEP=1 cargo test -p sim --test fingers instant -- --ignored --nocapture`

/// Instants of the press for each goal.
const INSTANTS: u64 = 500;

/// From the touch to the last instant, s.
const AFTER_TOUCH_S: f64 = 0.3;

/// Time watched after the event, s.
const WATCHED_S: f64 = 0.5;

const GOALS_N: [f64; 4] = [0.5, 1.0, 3.0, 7.0];

/// Compliance of the objects, mm/N: a wall and a soft one.
const OBJECTS_MM_PER_N: [f64; 2] = [0.0, 1.0];

/// Largest force that a release may leave, N. A touch that reads just below `contact_on_mn` is not released.
const LEFT_N: f64 = CONTACT_ON_N + 0.005;

/// An event: its name, whether the motor then moves the tip off the object, so that friction holds no force, a change of
/// the finger, and one of every frame from then on, with the codes of a tip that touches nothing.
type Disturbance = (&'static str, bool, fn(&mut Finger), fn(&mut Record, &Frame));

const BRIDGE_FAULT: &str = "a fault of the bridge";

const DISTURBANCES: [Disturbance; 5] = [
    ("torque off", false, |finger| finger.command().torque = false, |_, _| {}),
    ("goal 0", true, |finger| set_goal(finger, 0.0), |_, _| {}),
    (BRIDGE_FAULT, false, |_| {}, |record, _| record.sense.bridge_fault = true),
    ("a lost signal", false, |_| {}, show),
    (
        "a silent bus",
        true,
        |finger| finger.command().bus_watchdog_ms = 100,
        |record, _| record.sense.bus_silent_ms = 200,
    ),
];

/// The largest force after each event in one press, with the time after the touch, and the largest that is left 0.5 s
/// later. `first` and `every` choose the instants.
fn press(goal_n: f64, yield_mm_per_n: f64, first: u64, every: u64) -> [(f64, f64, f64); DISTURBANCES.len()] {
    let tables = object(2.0, yield_mm_per_n) + LOSSES;
    let (scene, approach_s) = (scene(&tables), touch_s(&tables, goal_n));
    let mut finger = begun(&scene);
    let (blank, begun_s) = (*finger.frame(), finger.time_s());
    set_goal(&mut finger, goal_n);
    let mut worst = [(0.0, 0.0, 0.0_f64); DISTURBANCES.len()];
    for instant in (first..INSTANTS).step_by(every as usize) {
        let at_s = (approach_s + AFTER_TOUCH_S) * instant as f64 / INSTANTS as f64;
        while finger.time_s() < begun_s + at_s {
            finger.step();
        }
        for ((.., happens, change), worst) in DISTURBANCES.into_iter().zip(&mut worst) {
            let mut copy = finger.fork(&scene).unwrap_or_else(|error| panic!("{error}"));
            happens(&mut copy);
            let peak_n = copy.run_with(WATCHED_S, |record| change(record, &blank)).max(finger.truth().force_n);
            if copy.command().bus_watchdog_ms > 0 {
                assert_eq!(copy.status().fault, Some(Fault::BusSilent));
            }
            worst.2 = worst.2.max(copy.truth().force_n);
            if peak_n > worst.0 {
                (worst.0, worst.1) = (peak_n, at_s - approach_s);
            }
        }
    }
    worst
}

sim::sizes!(
    an_event_at_any_instant_of_a_press_does_not_let_the_force_rise,
    keep_the_force(100),
    keep_the_force(std::env::var("INSTANTS_STEP").map_or(20, |step| step.parse().expect("a number from 1 on")))
);

fn keep_the_force(every: u64) {
    let presses: Vec<_> =
        GOALS_N.into_iter().flat_map(|goal_n| OBJECTS_MM_PER_N.map(|object| (goal_n, object))).collect();
    // Each press tries other instants, so that few of them cover the time more densely.
    let worst = cores::map(presses.iter().enumerate(), |(number, (goal_n, object))| {
        press(*goal_n, *object, every * number as u64 / presses.len() as u64, every)
    });
    let (mut cases, mut released) = (Vec::new(), Vec::new());
    for (index, (event, releases, ..)) in DISTURBANCES.into_iter().enumerate() {
        for ((goal_n, object), worst) in presses.iter().zip(&worst) {
            let (peak_n, at_s, left_n) = worst[index];
            let what = format!("{event} {at_s:+.4} s from the touch, goal {goal_n} N, {object} mm/N");
            if releases {
                released.push(Case::new(what.clone(), left_n, LEFT_N));
            }
            // The bridge is open after its fault: the motor coasts, and nothing can stop it.
            let most_n = if event == BRIDGE_FAULT { f64::INFINITY } else { most_n(*goal_n) };
            cases.push(Case::new(what, peak_n, most_n));
        }
    }
    judge("events at many instants", "N", &cases);
    judge("what is left 0.5 s after a release", "N", &released);
}

/// The copies above are exact.
#[test]
fn a_copy_of_a_finger_goes_on_to_the_bit() {
    let scene = scene(&(object(2.0, 1.0) + LOSSES));
    let mut finger = begun(&scene);
    crate::press(&mut finger, 3.0, 0.09);
    let mut copy = finger.fork(&scene).unwrap();
    for frame in 0..3_000 {
        assert_eq!(finger.step(), copy.step(), "frame {frame}");
        assert!(finger.record() == copy.record() && finger.truth() == copy.truth(), "frame {frame}");
    }
    assert!(finger.truth().force_n > 2.5);
}
