//! Conduct of a finger: what it must never do, and its holds and rests. Only the true state of the finger counts, never
//! what the controller reports.

use super::finger::{AtGoal, duty, newtons, note, trimmed};
use crate::watch::Step;
use fingertip::params::Params;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Time after the end of a contact in which the contact may still drive the tip.
const PUSHED_S: f64 = 0.02;
/// Time for which a goal that is taken back still counts: the tip needs it to leave an object that yields.
const TAKEN_BACK_S: f64 = 0.2;
/// Time within which the force must be gone after a stop, where the motor can move, s.
const STOP_S: f64 = 0.5;
/// Displacement of the object between two steps, mm, that counts as a motion.
const MOVES_MM: f64 = 1e-5;
/// Last part of the time of a goal; a goal is judged this long after it was requested and after the first touch.
const LAST_S: f64 = 0.2;
const JUDGED_S: f64 = 0.4;
const JUDGED_TOUCH_S: f64 = 0.22;

#[derive(Clone, Copy, Debug)]
struct Sample {
    time_s: f64,
    force_n: f64,
    travel_mm: f64,
    duty: f64,
}

/// Last part of a force that was held.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    pub goal_n: f64,
    pub mean_n: f64,
    pub swing_n: f64,
    pub missed: bool,
    /// True if a fault had stopped the motor.
    pub faulty: bool,
}

#[derive(Clone, Debug, Default)]
pub struct Conduct {
    /// Parameters of the controller: approach speed, clearance and largest travel.
    pub(super) approach_mm_per_s: f64,
    clearance_mm: f64,
    travel_mm: f64,
    goal_n: f64,
    /// Time since which the goal and an active motor are unchanged.
    since_s: f64,
    /// Time since which the goal is unchanged and no event disturbed the finger, and the first touch since then.
    quiet_s: f64,
    touched_s: Option<f64>,
    torque_off: bool,
    /// Goal with which the true force is compared.
    counted_n: f64,
    /// Time until which a contact that ended may drive the tip.
    thrown_s: f64,
    /// Travel at the first touch, less the place of the object.
    touch_mm: Option<f64>,
    place_mm: f64,
    nearest_mm: f64,
    /// Time until which the object may push a finger without a motor.
    pushed_s: f64,
    /// Time until which a defect may press.
    defective_s: f64,
    /// Time of the last stop; none before the first one, and after the object came nearer.
    stop_s: Option<f64>,
    indentation_max_mm: f64,
    last: VecDeque<Sample>,
    faulty: bool,
    ended: Ended,
    pub(super) travel_min_mm: f64,
    pub(super) runaway_mm: f64,
    pub(super) air_mm_per_s: f64,
    /// Largest true force beyond each goal, mN, except where a smaller goal has a larger one; also while a defect acts.
    pub(super) over_force_mn: Vec<AtGoal>,
    pub(super) over_force_defective_mn: Vec<AtGoal>,
    pub(super) stop_force_n: f64,
    pub(super) disturbed: bool,
}

/// Goals that are over.
#[derive(Clone, Debug, Default)]
pub(super) struct Ended {
    pub holds: Vec<Hold>,
    /// Range of the tip at rest after a release.
    pub rest_mm: Option<f64>,
    /// Deviation of the duty, during a hold or after a release.
    pub duty: Option<f64>,
}

impl Conduct {
    pub fn of(params: &Params) -> Self {
        let [approach_mm_per_s, clearance_mm, travel_mm] =
            [params.approach_um_per_s, params.clearance_um, params.travel_max_um].map(|um| f64::from(um) * 1e-3);
        Self { approach_mm_per_s, clearance_mm, travel_mm, ..Self::default() }
    }

    /// Adds a control step after the start of the scene.
    pub(super) fn step(&mut self, step: &Step) {
        let Step { time_s, truth, command, status, .. } = *step;
        let goal_n = newtons(command.goal);
        let steps = goal_n != self.goal_n && !trimmed(self.goal_n, goal_n);
        let restarts = steps || truth.disturbed || command.torque == self.torque_off;
        if restarts {
            if !self.last.is_empty() {
                self.ended = self.ended();
                self.last.clear();
            }
            self.quiet_s = time_s;
            self.touched_s = None;
        }
        if truth.force_n > 0.0 {
            self.touched_s.get_or_insert(time_s);
        }
        let passive = !command.torque || status.fault.is_some();
        if steps || passive {
            self.since_s = time_s;
        }
        self.goal_n = goal_n;
        self.disturbed |= truth.disturbed;
        self.faulty = status.fault.is_some() || self.faulty && !restarts;
        let along_mm = if step.finger == 0 { truth.object_mm[0] } else { -truth.object_mm[0] };
        let place_mm = along_mm + truth.object_away_mm;
        let came = self.disturbed && place_mm < self.place_mm - MOVES_MM;
        self.place_mm = place_mm;
        self.press(step, passive, came);
        self.stop(step, came);
        self.torque_off = !command.torque;
        self.go(step);
        if !truth.disturbed {
            let sample = Sample { time_s, force_n: truth.force_n, travel_mm: truth.travel_mm, duty: duty(status.duty) };
            while self.last.pop_front_if(|first| first.time_s < time_s - LAST_S).is_some() {}
            self.last.push_back(sample);
        }
    }

    /// Measures the true force that remains after a stop although the motor could move, or beyond what friction holds.
    fn stop(&mut self, step: &Step, came: bool) {
        let Step { time_s, truth, command, status, .. } = *step;
        let acts_again = status.fault.is_some() || command.torque && self.torque_off;
        if command.torque && self.goal_n > 0.0 {
            self.stop_s = Some(time_s);
        } else if came {
            self.stop_s = None;
        } else if acts_again {
            self.stop_s = self.stop_s.map(|_| time_s);
        } else if self.stop_s.is_some_and(|stop_s| time_s > stop_s + STOP_S) {
            let held_n = if command.torque { 0.0 } else { truth.friction_n };
            self.stop_force_n = self.stop_force_n.max(truth.force_n - held_n);
        }
    }

    /// Compares the true force with the goal. After a fault the goal still counts: the finger cannot release without a
    /// motor. The push of the object on a finger without a motor does not count.
    fn press(&mut self, step: &Step, passive: bool, came: bool) {
        let Step { time_s, truth, .. } = *step;
        if passive && (came || time_s < self.pushed_s) {
            self.pushed_s = time_s + TAKEN_BACK_S;
        }
        if truth.defective || passive && time_s < self.defective_s {
            self.defective_s = time_s + TAKEN_BACK_S;
        }
        let over = time_s >= self.since_s + TAKEN_BACK_S;
        if !self.faulty && (self.goal_n > self.counted_n || over) {
            self.counted_n = self.goal_n;
        }
        if truth.force_n > 0.0 && time_s >= self.pushed_s {
            let defective = time_s < self.defective_s;
            let kept = if defective { &mut self.over_force_defective_mn } else { &mut self.over_force_mn };
            note(kept, AtGoal { goal_n: self.counted_n, value: 1e3 * (truth.force_n - self.counted_n) });
        }
    }

    fn go(&mut self, step: &Step) {
        let truth = step.truth;
        self.travel_min_mm = self.travel_min_mm.min(truth.travel_mm);
        self.indentation_max_mm = self.indentation_max_mm.max(truth.indentation_mm);
        if truth.force_n > 0.0 {
            self.thrown_s = step.time_s + PUSHED_S;
            self.touch_mm.get_or_insert(truth.travel_mm - self.place_mm);
        } else if step.time_s > self.thrown_s.max(self.pushed_s) {
            self.air_mm_per_s = self.air_mm_per_s.max(truth.speed_mm_per_s.abs());
        }
        self.nearest_mm = self.nearest_mm.min(self.place_mm);
        let deepest_mm = self.nearest_mm - self.indentation_max_mm;
        let rear_mm = self.touch_mm.map_or(0.0, |touch_mm| touch_mm + deepest_mm) - self.clearance_mm;
        let beyond_mm = (rear_mm - truth.travel_mm).max(truth.travel_mm - self.travel_mm);
        self.runaway_mm = self.runaway_mm.max(beyond_mm);
    }

    /// Returns all goals, with the current one if it had its time.
    pub(super) fn ended(&self) -> Ended {
        let mut ended = self.ended.clone();
        let touched_s = self.touched_s.filter(|_| self.goal_n > 0.0).unwrap_or(self.quiet_s);
        let judged_s = (self.quiet_s + JUDGED_S).max(touched_s + JUDGED_TOUCH_S);
        if self.last.back().is_none_or(|last| last.time_s < judged_s) {
            return ended;
        }
        let worse = |known: Option<f64>, value: f64| Some(known.map_or(value, |known| known.max(value)));
        let spreads = [|s: &Sample| s.force_n, |s: &Sample| s.travel_mm, |s: &Sample| s.duty]
            .map(|of| spread(self.last.iter().map(of)));
        let [[mean_n, _, swing_n], [_, _, rest_mm], [_, deviation, _]] = spreads;
        ended.duty = worse(ended.duty, deviation);
        if self.goal_n > 0.0 {
            ended.holds.push(Hold { goal_n: self.goal_n, mean_n, swing_n, missed: mean_n == 0.0, faulty: self.faulty });
        } else {
            ended.rest_mm = worse(ended.rest_mm, rest_mm);
        }
        ended
    }
}

impl Ended {
    /// Returns the errors of the holds, mN, without those of a fault.
    pub fn errors_mn(&self) -> Vec<AtGoal> {
        let judged = self.holds.iter().filter(|hold| !hold.faulty);
        judged.map(|hold| AtGoal { goal_n: hold.goal_n, value: 1e3 * (hold.mean_n - hold.goal_n).abs() }).collect()
    }

    /// Returns the ranges of the force in holds, mN.
    pub fn swings_mn(&self) -> Vec<AtGoal> {
        self.holds.iter().map(|hold| AtGoal { goal_n: hold.goal_n, value: 1e3 * hold.swing_n }).collect()
    }

    pub fn missed(&self) -> usize {
        self.holds.iter().filter(|hold| hold.missed && !hold.faulty).count()
    }
}

/// Mean, standard deviation and range.
fn spread(values: impl Iterator<Item = f64> + Clone) -> [f64; 3] {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let square = values.clone().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    let fold = |of: fn(f64, f64) -> f64| values.clone().reduce(of).unwrap_or(0.0);
    [mean, square.sqrt(), fold(f64::max) - fold(f64::min)]
}
