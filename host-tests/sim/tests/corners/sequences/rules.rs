//! What every sequence must keep.

use crate::{CONTACT_ON_N, most_n};
use fingertip::command::Command;
use fingertip::params::Params;
use fingertip::state::Mode;
use std::collections::VecDeque;

/// A goal that is taken back counts for this long.
const RECENT_S: f64 = 0.2;

/// The largest force of a press that measures.
const MEASURING_N: f64 = Params::DEFAULT.force_max_mn as f64 * 1e-3;

/// The largest force allowed, frame by frame.
#[derive(Default)]
pub struct Forces {
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
    pub fn observe(&mut self, time_s: f64, force_n: f64, command: &Command, mode: Mode, approaching: bool) {
        let driven = matches!(mode, Mode::Approach | Mode::Force | Mode::Release | Mode::Press);
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
            self.pushed_n = self.pushed_n.max(force_n);
            self.pushed_s = time_s;
        } else if self.pushed_n > 0.0 {
            let corrected = mode == Mode::Force && time_s > self.pushed_s + 0.3;
            let settling = time_s < self.pushed_s + 0.05;
            self.pushed_n = if force_n < CONTACT_ON_N || corrected {
                0.0
            } else if settling {
                self.pushed_n.max(force_n)
            } else {
                self.pushed_n
            };
        }
    }

    /// The force that the object caused and that may still be there.
    pub fn pushed_n(&self) -> f64 {
        self.pushed_n
    }

    /// The reason where the force is too large.
    pub fn broken(&self, force_n: f64) -> Option<String> {
        let goal_n = self.goals.iter().map(|(_, goal_n)| *goal_n).fold(self.goal_n, f64::max);
        let most_n = most_n(goal_n).max(self.left_n + 0.05).max(1.05 * self.pushed_n + 0.05);
        (force_n > most_n).then(|| format!("{force_n:.3} N, {most_n:.3} N allowed for a goal of {goal_n:.3} N"))
    }
}

/// Whether a mode drives the motor for a goal or a measurement, so that torque off ends it.
pub fn needs_torque(mode: Mode) -> bool {
    matches!(mode, Mode::Approach | Mode::Force | Mode::Release | Mode::Press)
}

/// The table of modes in `src/state.rs`: the reason where a change is not in it.
pub fn check_mode(before: Mode, now: Mode, command: &Command) -> Option<String> {
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
    if !command.torque && needs_torque(now) {
        return Some(format!("torque is off in {now:?}"));
    }
    (!allowed).then(|| format!("{before:?} to {now:?} is not in the table of modes"))
}
