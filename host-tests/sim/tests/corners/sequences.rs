//! Random sequences of requests and of motions of the object, judged by the true force and the table of modes.
//!
//! The first sequences that fail are shortened and printed: 6, or `SHOWN=n`. `SEQUENCES=n` tries n. Without
//! `--profile host` the core also checks its arithmetic for overflow:
//! `SEQUENCES=2000 cargo test -p sim --test corners sequences -- --nocapture`

mod events;
mod rules;

use crate::{CONTACT_ON_N, Finger, fault, finger, force_n, mode, number, set_goal};
use events::{Event, Sequence};
use fingertip::state::Mode;
use rules::{Forces, check_mode, needs_torque};
use sim::cores;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The usual number of sequences: about 20 s of one core.
const USUAL: u64 = 600;

/// An object that is taken away is this far off.
const AWAY_MM: f64 = 100.0;

/// Time of a frame, about, s.
const FRAME_S: f64 = 1e-4;

/// A finger that a sequence happens to, and what is judged of it.
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
        let force_n = force_n(&mut self.finger);
        let now = mode(&self.finger);
        self.forces.observe(time_s, force_n, &command, now, approaching);
        let broken = self.forces.broken(force_n).or_else(|| check_mode(self.before, now, &command));
        if let (None, Some(reason)) = (&self.broken, broken) {
            self.broken = Some(format!("{time_s:.4} s, {now:?} {:?}: {reason}", fault(&self.finger)));
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
            // In front of the tip, wherever that is by then.
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
        let (from_mm, to_mm) = (self.object_mm, self.object_mm + by_mm);
        let frames = (by_mm.abs() / mm_per_s / FRAME_S).ceil() as u32;
        for frame in 1..=frames {
            self.place(from_mm + (to_mm - from_mm) * f64::from(frame) / f64::from(frames));
            self.finger.step();
            self.frame(by_mm < 0.0);
        }
    }

    /// The stop promise: some time after the last event, which ends pressing, nothing is pressed any more.
    fn end(&mut self) {
        // The last event is acknowledged in the next frame; a press that measures ends by itself.
        self.wait(0.002);
        let until_s = self.finger.time_s() + 10.0;
        while mode(&self.finger) == Mode::Press && self.finger.time_s() < until_s {
            self.wait(0.1);
        }
        let driven = needs_torque(mode(&self.finger));
        let (stop_s, held_n) = self.sequence.stops(driven);
        self.wait(stop_s);
        let left_n = force_n(&mut self.finger);
        if left_n > CONTACT_ON_N + held_n && self.forces.pushed_n() == 0.0 {
            let reason = format!("{left_n:.3} N are left {stop_s} s after the end, {held_n:.3} N allowed for friction");
            let state = format!("{:?} {:?}", mode(&self.finger), fault(&self.finger));
            self.broken.get_or_insert(format!("at the end, {state}: {reason}"));
        }
    }
}

/// Lets a sequence happen; returns the first rule that it broke.
fn broken(sequence: &Sequence) -> Option<String> {
    let run = || {
        let mut finger = finger(&sequence.tables());
        finger.command().torque = false;
        let (object_mm, before) = (sequence.distance_mm, mode(&finger));
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

/// Leaves events out, one by one, as long as a rule is still broken.
fn shortened(mut sequence: Sequence, mut reason: String) -> (Sequence, String) {
    let mut place = 0;
    // The last event ends pressing; the end is judged by it.
    while place + 1 < sequence.events.len() {
        let mut shorter = sequence.clone();
        let (after_s, _) = shorter.events.remove(place);
        shorter.events[place].0 += after_s;
        match broken(&shorter) {
            Some(still) => (sequence, reason) = (shorter, still),
            None => place += 1,
        }
    }
    (sequence, reason)
}

#[test]
fn random_sequences_keep_the_force_in_bounds_and_the_table_of_modes() {
    let count = number("SEQUENCES", USUAL);
    let failed: Vec<_> = cores::map(0..count, |seed| broken(&Sequence::drawn(seed)).map(|reason| (seed, reason)));
    let failed: Vec<_> = failed.into_iter().flatten().collect();
    println!("{} of {count} sequences break a rule", failed.len());
    for (seed, reason) in &failed {
        println!("{seed}: {reason}");
    }
    let shown = cores::map(failed.iter().take(number("SHOWN", 6) as usize), |(seed, reason)| {
        let (sequence, reason) = shortened(Sequence::drawn(*seed), reason.clone());
        println!("{seed}: {reason}\n{sequence}");
        format!("{seed}: {reason}\n{sequence}")
    });
    assert!(failed.is_empty(), "{} of {count} sequences break a rule, such as\n{}", failed.len(), shown.join("\n"));
}
