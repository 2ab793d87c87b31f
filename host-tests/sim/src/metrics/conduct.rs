//! How a finger behaved: what it must never do, and what it was like once a goal had had its time. All of it is judged
//! by what is true of the finger, never by what the controller reports.

use super::at_goal::{AtGoal, note};
use super::finger::{duty, newtons, trimmed};
use crate::watch::Step;
use fingertip::params::Params;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// A contact that ended may still drive the tip for this long.
const PUSHED_S: f64 = 0.02;
/// A goal that is taken back counts for this long: so long may the tip need to come out of a thing that yields.
const TAKEN_BACK_S: f64 = 0.2;
/// The last part of a goal's time, and the time from which on a goal has one to judge.
const LAST_S: f64 = 0.2;
const JUDGED_S: f64 = 0.4;

/// What is true at a step.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time_s: f64,
    force_n: f64,
    travel_mm: f64,
    duty: f64,
}

/// A force that was held: the last part of its time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// What was asked for.
    pub goal_n: f64,
    /// Mean of the true force.
    pub mean_n: f64,
    /// From the least to the largest true force.
    pub swing_n: f64,
    /// Whether nothing was touched.
    pub missed: bool,
    /// Whether a fault had stopped the motor.
    pub faulty: bool,
}

/// One finger's conduct so far.
#[derive(Clone, Debug)]
pub struct Conduct {
    approach_mm_per_s: f64,
    clearance_mm: f64,
    travel_limit_mm: f64,
    goal_n: f64,
    since_s: f64,
    /// The goal that the true force is held against.
    counted_n: f64,
    contact_s: f64,
    touch_mm: Option<f64>,
    indentation_max_mm: f64,
    last: VecDeque<Sample>,
    faulty: bool,
    ended: Ended,
    pub(super) travel_min_mm: f64,
    pub(super) runaway_mm: f64,
    air_mm_per_s: f64,
    over_force: Vec<AtGoal>,
}

/// The goals that are over.
#[derive(Clone, Debug, Default)]
pub(super) struct Ended {
    /// Those that asked for a force.
    pub holds: Vec<Hold>,
    /// From the farthest to the nearest place of the tip at rest after letting go.
    pub rest_mm: Option<f64>,
    /// Deviation of the duty, of a hold or after letting go.
    pub duty: Option<f64>,
}

impl Default for Conduct {
    fn default() -> Self {
        Self::of(&Params::DEFAULT)
    }
}

impl Conduct {
    /// With the limits that the controller is given.
    pub fn of(params: &Params) -> Self {
        Self {
            approach_mm_per_s: f64::from(params.approach_um_per_s) * 1e-3,
            clearance_mm: f64::from(params.clearance_um) * 1e-3,
            travel_limit_mm: f64::from(params.travel_max_um) * 1e-3,
            goal_n: 0.0,
            since_s: 0.0,
            counted_n: 0.0,
            contact_s: f64::NEG_INFINITY,
            touch_mm: None,
            indentation_max_mm: 0.0,
            last: VecDeque::new(),
            faulty: false,
            ended: Ended::default(),
            travel_min_mm: 0.0,
            runaway_mm: 0.0,
            air_mm_per_s: 0.0,
            over_force: Vec::new(),
        }
    }

    /// A control step, from the scene's start on.
    pub(super) fn step(&mut self, step: &Step) {
        let goal_n = newtons(step.command.goal);
        if goal_n != self.goal_n {
            if !trimmed(self.goal_n, goal_n) {
                self.ended = self.ended();
                self.since_s = step.time_s;
                self.last.clear();
            }
            self.goal_n = goal_n;
        }
        self.faulty |= step.status.fault.is_some();
        self.press(step);
        self.go(step);
        let Step { time_s, truth, .. } = *step;
        let sample =
            Sample { time_s, force_n: truth.force_n, travel_mm: truth.travel_mm, duty: duty(step.status.duty) };
        while self.last.pop_front_if(|first| first.time_s < time_s - LAST_S).is_some() {}
        self.last.push_back(sample);
    }

    /// The true force against the goal. A fault leaves the goal that counted: what was pressed need not be let go
    /// without a motor.
    fn press(&mut self, step: &Step) {
        let over = step.time_s >= self.since_s + TAKEN_BACK_S;
        if !self.faulty && (self.goal_n > self.counted_n || over) {
            self.counted_n = self.goal_n;
        }
        if step.truth.force_n > 0.0 {
            note(&mut self.over_force, AtGoal { goal_n: self.counted_n, value: step.truth.force_n - self.counted_n });
        }
    }

    fn go(&mut self, step: &Step) {
        let truth = step.truth;
        self.travel_min_mm = self.travel_min_mm.min(truth.travel_mm);
        self.indentation_max_mm = self.indentation_max_mm.max(truth.indentation_mm);
        if truth.force_n > 0.0 {
            self.contact_s = step.time_s;
            self.touch_mm.get_or_insert(truth.travel_mm);
        } else if step.time_s > self.contact_s + PUSHED_S {
            self.air_mm_per_s = self.air_mm_per_s.max(truth.speed_mm_per_s.abs());
        }
        let rear_mm = self.touch_mm.map_or(0.0, |touch_mm| touch_mm - self.indentation_max_mm) - self.clearance_mm;
        let beyond_mm = (rear_mm - truth.travel_mm).max(truth.travel_mm - self.travel_limit_mm);
        self.runaway_mm = self.runaway_mm.max(beyond_mm);
    }

    /// All goals, the one under way included where it had its time.
    pub(super) fn ended(&self) -> Ended {
        let mut ended = self.ended.clone();
        if self.last.back().is_none_or(|last| last.time_s < self.since_s + JUDGED_S) {
            return ended;
        }
        let worse = |known: Option<f64>, value: f64| Some(known.map_or(value, |known| known.max(value)));
        let [force_n, travel_mm, duty] = [|s: &Sample| s.force_n, |s: &Sample| s.travel_mm, |s: &Sample| s.duty]
            .map(|of| Spread::of(self.last.iter().map(of)));
        ended.duty = worse(ended.duty, duty.deviation);
        if self.goal_n > 0.0 {
            ended.holds.push(Hold {
                goal_n: self.goal_n,
                mean_n: force_n.mean,
                swing_n: force_n.width,
                missed: force_n.mean == 0.0,
                faulty: self.faulty,
            });
        } else {
            ended.rest_mm = worse(ended.rest_mm, travel_mm.width);
        }
        ended
    }

    /// Largest true force beyond each goal, where no lesser goal has a larger one.
    pub(super) fn over_force(&self) -> &[AtGoal] {
        &self.over_force
    }

    /// Largest speed without a contact, of the approach speed.
    pub(super) fn air_share(&self) -> f64 {
        self.air_mm_per_s / self.approach_mm_per_s
    }
}

impl Ended {
    /// What holds were off by; a fault's hold is not judged.
    pub fn errors(&self) -> Vec<AtGoal> {
        let judged = self.holds.iter().filter(|hold| !hold.faulty);
        judged.map(|hold| AtGoal { goal_n: hold.goal_n, value: (hold.mean_n - hold.goal_n).abs() }).collect()
    }

    /// How far the force swung in holds.
    pub fn swings(&self) -> Vec<AtGoal> {
        self.holds.iter().map(|hold| AtGoal { goal_n: hold.goal_n, value: hold.swing_n }).collect()
    }

    /// Holds that touched nothing.
    pub fn missed(&self) -> usize {
        self.holds.iter().filter(|hold| hold.missed && !hold.faulty).count()
    }
}

/// Mean, deviation from it, and from the least to the largest.
struct Spread {
    mean: f64,
    deviation: f64,
    width: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count().max(1) as f64;
        let mean = values.clone().sum::<f64>() / count;
        let square = values.clone().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
        let fold = |of: fn(f64, f64) -> f64| values.clone().reduce(of).unwrap_or(0.0);
        Self { mean, deviation: square.sqrt(), width: fold(f64::max) - fold(f64::min) }
    }
}
