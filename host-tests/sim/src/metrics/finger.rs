//! Measurements of one finger, step by step. No trace is kept, so memory grows with the number of goals only.

use crate::metrics::conduct::Conduct;
use crate::watch::Step;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::state::{Fault, Mode};
use fingertip::units::{Duty, Millimetres, Newtons};
use std::collections::VecDeque;

/// Force from which on errors of the centre count: below it the array sees next to nothing.
const SEEN_N: f64 = 0.1;
/// Time before the touch over which the approach speed is averaged.
const APPROACH_S: f64 = 0.01;
/// Change of a goal below which the goal is only trimmed: not a step to judge.
const STEP_N: f64 = 0.02;
/// Distance below its highest place from which on an object counts as dropped.
pub(super) const DROPPED_MM: f64 = 5.0;

/// Force as the controller estimates it: the reading, less creep and temperature compensation while a force is held.
fn sensed_n(status: &Status) -> f64 {
    let beside_n = if status.mode == Mode::Force { newtons(status.creep) + newtons(status.drift) } else { 0.0 };
    newtons(status.contact.force) - beside_n
}

/// Integral of a square over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Squares {
    sum: f64,
    time_s: f64,
    pub max: f64,
}

impl Squares {
    fn add(&mut self, value: f64, dt_s: f64) {
        self.sum += value * value * dt_s;
        self.time_s += dt_s;
        self.max = self.max.max(value.abs());
    }

    /// Root mean square; none if nothing was added.
    pub fn rms(&self) -> Option<f64> {
        (self.time_s > 0.0).then(|| (self.sum / self.time_s).sqrt())
    }
}

#[derive(Clone, Debug, Default)]
pub struct Finger {
    last_s: Option<f64>,
    goal_n: f64,
    /// Responses to all goals. The last one continues while `responds`.
    responses: Vec<Response>,
    responds: bool,
    /// Times and travels shortly before the touch.
    approach: VecDeque<[f64; 2]>,
    missed_before: u32,
    fault: Option<Fault>,
    object_start_mm: f64,
    object_highest_mm: f64,
    pub(super) peak_n: f64,
    pub(super) touch_s: Option<f64>,
    pub(super) approach_mm_per_s: Option<f64>,
    pub(super) travel_max_mm: f64,
    pub(super) indentation_max_mm: f64,
    pub(super) faults: u32,
    pub(super) first_fault: Option<(Fault, f64)>,
    /// Time under each limit, by its bit.
    pub(super) limits_s: [f64; 9],
    pub(super) time_s: f64,
    pub(super) missed: u32,
    pub(super) duty: Squares,
    pub(super) force_error_n: Squares,
    pub(super) centre_error_mm: Option<f64>,
    pub(super) confidence_min: Option<u8>,
    pub(super) slip_mm: f64,
    pub(super) slips: Slips,
    pub(super) broken: bool,
    pub(super) object_lift_mm: f64,
    pub(super) object_fall_mm: f64,
    pub(super) energy_j: f64,
    pub(super) current_a: Squares,
    pub(super) winding_max_c: Option<f64>,
    pub(super) conduct: Conduct,
}

impl Finger {
    pub(super) fn of(params: &Params) -> Self {
        Self { conduct: Conduct::of(params), ..Self::default() }
    }

    pub(super) fn step(&mut self, step: &Step) {
        if step.time_s < 0.0 {
            self.missed_before = step.status.missed_frames;
            return;
        }
        let dt_s = self.last_s.map_or(0.0, |last_s| step.time_s - last_s);
        let begins = self.last_s.replace(step.time_s).is_none();
        self.time_s += dt_s;
        self.force(step);
        self.controller(step, dt_s);
        self.sensing(step, dt_s);
        self.drive(step, dt_s);
        self.object(step, begins);
        self.conduct.step(step);
    }

    /// Returns the largest of a value over all responses, at least 0; none without a response, or if one has no value.
    pub(super) fn worst(&self, value: impl Fn(&Response) -> Option<f64>) -> Option<f64> {
        let values: Option<Vec<f64>> = self.responses.iter().map(value).collect();
        values.filter(|values| !values.is_empty()).map(|values| values.into_iter().fold(0.0, f64::max))
    }

    /// Returns the largest steady error and its root mean square over all responses.
    pub(super) fn steady_error_n(&self) -> Option<[f64; 2]> {
        let largest_n = self.worst(|response| Some(response.steady_n.max))?;
        let mut all = Squares::default();
        for Response { steady_n, .. } in &self.responses {
            (all.sum, all.time_s) = (all.sum + steady_n.sum, all.time_s + steady_n.time_s);
        }
        Some([largest_n, all.rms()?])
    }

    fn force(&mut self, step: &Step) {
        let (force_n, goal_n) = (step.truth.force_n, newtons(step.command.goal));
        self.peak_n = self.peak_n.max(force_n);
        self.travel_max_mm = self.travel_max_mm.max(step.truth.travel_mm);
        self.indentation_max_mm = self.indentation_max_mm.max(step.truth.indentation_mm);
        if force_n > 0.0 && self.touch_s.is_none() {
            self.touch(step);
        }
        if goal_n != self.goal_n {
            let trimmed = self.responds && trimmed(self.goal_n, goal_n);
            self.goal_n = goal_n;
            if !trimmed {
                self.respond(force_n, force_n);
            }
        } else if !self.responds {
            self.respond(0.0, force_n);
        }
        if let Some(response) = self.responses.last_mut().filter(|_| self.responds) {
            response.add(step.time_s, force_n);
        }
    }

    /// Begins a response from a force if there is a goal and a contact.
    fn respond(&mut self, from_n: f64, force_n: f64) {
        self.responds = self.goal_n > 0.0 && force_n > 0.0;
        if self.responds {
            self.responses.push(Response::new(from_n, self.goal_n));
        }
    }

    fn touch(&mut self, step: &Step) {
        self.touch_s = Some(step.time_s);
        let start = self.approach.iter().rfind(|[time_s, _]| *time_s <= step.time_s - APPROACH_S);
        self.approach_mm_per_s = start
            .or(self.approach.front())
            .map(|[time_s, travel_mm]| (step.truth.travel_mm - travel_mm) / (step.time_s - time_s));
        self.approach = VecDeque::new();
    }

    fn controller(&mut self, step: &Step, dt_s: f64) {
        let status = step.status;
        if self.touch_s.is_none() {
            while self.approach.pop_front_if(|[time_s, _]| *time_s <= step.time_s - 2.0 * APPROACH_S).is_some() {}
            self.approach.push_back([step.time_s, step.truth.travel_mm]);
        }
        if let Some(fault) = status.fault.filter(|fault| self.fault != Some(*fault)) {
            self.faults += u32::from(!step.truth.defective);
            self.first_fault.get_or_insert((fault, step.time_s));
        }
        self.fault = status.fault;
        for (bit, seen_s) in self.limits_s.iter_mut().enumerate() {
            if status.limits.has(1 << bit) {
                *seen_s += dt_s;
            }
        }
        self.missed = status.missed_frames.wrapping_sub(self.missed_before);
        self.duty.add(duty(status.duty), dt_s);
    }

    fn sensing(&mut self, step: &Step, dt_s: f64) {
        let (contact, truth) = (&step.status.contact, step.truth);
        self.force_error_n.add(sensed_n(step.status) - truth.force_n, dt_s);
        if truth.force_n > SEEN_N {
            let off = |sensed: Millimetres, true_mm: f64| sensed.0.to_num::<f64>() - true_mm;
            let [x, y] = [off(contact.centre_x, truth.centre_mm[0]), off(contact.centre_y, truth.centre_mm[1])];
            let error_mm = (x * x + y * y).sqrt();
            self.centre_error_mm = Some(self.centre_error_mm.map_or(error_mm, |max| max.max(error_mm)));
        }
        if self.responds && self.responses.last().is_some_and(|response| response.is_steady(step.time_s)) {
            let confidence = contact.confidence;
            self.confidence_min = Some(self.confidence_min.map_or(confidence, |min| min.min(confidence)));
        }
    }

    fn drive(&mut self, step: &Step, dt_s: f64) {
        let truth = step.truth;
        self.current_a.add(truth.current_a, dt_s);
        self.energy_j += duty(step.status.duty) * truth.supply_v * truth.current_a * dt_s;
        self.winding_max_c = Some(self.winding_max_c.map_or(truth.winding_c, |max| max.max(truth.winding_c)));
    }

    fn object(&mut self, step: &Step, begins: bool) {
        let truth = step.truth;
        let height_mm = truth.object_mm[1];
        if begins {
            (self.object_start_mm, self.object_highest_mm) = (height_mm, height_mm);
        }
        self.object_highest_mm = self.object_highest_mm.max(height_mm);
        self.object_lift_mm = height_mm - self.object_start_mm;
        self.object_fall_mm = self.object_fall_mm.max(self.object_highest_mm - height_mm);
        self.broken |= truth.broken;
        self.slip_mm = self.slip_mm.max(truth.slip_mm);
        self.slips.step(step.time_s, truth.slip_mm, newtons(step.command.goal));
    }
}

pub(super) fn trimmed(from_n: f64, to_n: f64) -> bool {
    from_n > 0.0 && to_n > 0.0 && (to_n - from_n).abs() < STEP_N
}

/// Duty as a share of the supply.
pub fn duty(duty: Duty) -> f64 {
    f64::from(duty.0) / f64::from(Duty::FULL)
}

pub fn newtons(force: Newtons) -> f64 {
    force.0.to_num()
}

/// Error within which a step counts as settled, as a share of the goal or of the step, whichever is smaller.
const SETTLED_SHARE: f64 = 0.02;
/// Time after the change of the goal from which on the steady error counts.
const STEADY_AFTER_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Response {
    from_n: f64,
    goal_n: f64,
    start_s: Option<f64>,
    before: Option<[f64; 2]>,
    tenth_s: Option<f64>,
    nine_tenths_s: Option<f64>,
    /// Largest force beyond the goal, in the direction of the step.
    pub beyond_n: f64,
    inside_since_s: Option<f64>,
    /// Steady errors; each sample counts as a second.
    steady_n: Squares,
}

impl Response {
    /// Response to a goal from the force at its change; from 0 at the touch.
    pub fn new(from_n: f64, goal_n: f64) -> Self {
        Self { from_n, goal_n, ..Self::default() }
    }

    /// Adds the true force at a time. The first call is the start.
    pub fn add(&mut self, time_s: f64, force_n: f64) {
        self.start_s.get_or_insert(time_s);
        let way_n = self.goal_n - self.from_n;
        let share = (force_n - self.from_n) / way_n;
        let before = self.before.replace([time_s, share]);
        for (part, reached_s) in [(0.1, &mut self.tenth_s), (0.9, &mut self.nine_tenths_s)] {
            if reached_s.is_none() && share >= part {
                *reached_s = Some(crossing_s(before, [time_s, share], part));
            }
        }
        let error_n = force_n - self.goal_n;
        self.beyond_n = self.beyond_n.max(error_n * way_n.signum());
        if error_n.abs() > SETTLED_SHARE * self.unit_n() {
            self.inside_since_s = None;
        } else {
            self.inside_since_s.get_or_insert(time_s);
        }
        if self.is_steady(time_s) {
            self.steady_n.add(error_n, 1.0);
        }
    }

    /// Goal or step, whichever is smaller: the unit of overshoot and settling.
    pub fn unit_n(&self) -> f64 {
        (self.goal_n - self.from_n).abs().min(self.goal_n)
    }

    /// Time from 10 % to 90 % of the step; none if the force does not reach 90 %.
    pub fn rise_s(&self) -> Option<f64> {
        Some(self.nine_tenths_s? - self.tenth_s?)
    }

    /// Time from the start until the force stays within 2 % of [`Response::unit_n`]; none if it never does.
    pub fn settled_s(&self) -> Option<f64> {
        Some(self.inside_since_s? - self.start_s?)
    }

    pub fn is_steady(&self, time_s: f64) -> bool {
        self.start_s.is_some_and(|start_s| time_s >= start_s + STEADY_AFTER_S)
    }
}

/// Time at which a share was crossed, by linear interpolation between samples.
fn crossing_s(before: Option<[f64; 2]>, [after_s, after]: [f64; 2], part: f64) -> f64 {
    let Some([before_s, before]) = before else { return after_s };
    let (low, high) = (before - part, after - part);
    before_s + (after_s - before_s) * low / (low - high)
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AtGoal {
    pub goal_n: f64,
    /// The value, in the metric's unit.
    pub value: f64,
}

/// Adds a value unless a smaller goal has a larger one, and removes those that it exceeds in this way.
pub fn note(kept: &mut Vec<AtGoal>, new: AtGoal) {
    let covers = |a: &AtGoal, b: &AtGoal| a.goal_n <= b.goal_n && a.value >= b.value;
    if !kept.iter().any(|known| covers(known, &new)) {
        kept.retain(|known| !covers(&new, known));
        kept.push(new);
    }
}

/// Shortest slip that counts. A shorter one is creep at rest.
const COUNTS_MM: f64 = 1e-3;
/// Time without motion after which a slip is over.
const OVER_S: f64 = 0.01;

#[derive(Clone, Copy, Debug, Default)]
pub struct Slips {
    under_way: Option<Slip>,
    last_mm: f64,
    pub count: u32,
    /// Number of slips that were over before the goal rose.
    pub unnoticed: u32,
    /// Longest time from the onset of a slip to the rise of the goal.
    pub noticed_after_s: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Slip {
    onset_s: f64,
    moved_s: f64,
    from_mm: f64,
    goal_n: f64,
    counted: bool,
    noticed: bool,
}

impl Slips {
    pub fn step(&mut self, time_s: f64, slip_mm: f64, goal_n: f64) {
        let moves = slip_mm > self.last_mm;
        let before_mm = core::mem::replace(&mut self.last_mm, slip_mm);
        if moves {
            let begun =
                Slip { onset_s: time_s, moved_s: time_s, from_mm: before_mm, goal_n, counted: false, noticed: false };
            let slip = self.under_way.get_or_insert(begun);
            slip.moved_s = time_s;
            if !slip.counted && slip_mm - slip.from_mm > COUNTS_MM {
                slip.counted = true;
                self.count += 1;
            }
        }
        let Some(slip) = &mut self.under_way else { return };
        if goal_n > slip.goal_n && !slip.noticed {
            slip.noticed = true;
            let after_s = time_s - slip.onset_s;
            self.noticed_after_s = Some(self.noticed_after_s.map_or(after_s, |longest| longest.max(after_s)));
        }
        if time_s - slip.moved_s > OVER_S {
            self.unnoticed += u32::from(slip.counted && !slip.noticed);
            self.under_way = None;
        }
    }

    /// Number of unnoticed slips, with one that the end of the run interrupted.
    pub fn unnoticed(&self) -> u32 {
        self.unnoticed + self.under_way.map_or(0, |slip| u32::from(slip.counted && !slip.noticed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_timed_from_its_onset_to_the_raised_goal() {
        let mut slips = Slips::default();
        for ms in 0..100 {
            let time_s = f64::from(ms) * 1e-3;
            // Slips from 20 ms on, until the force is raised at 26 ms; again from 60 to 70 ms without a reaction.
            let slip_mm = 0.1 * f64::from((ms - 19).clamp(0, 8) + (ms - 59).clamp(0, 11));
            slips.step(time_s, slip_mm, if ms < 26 { 1.0 } else { 1.5 });
        }
        assert_eq!((slips.count, slips.unnoticed()), (2, 1));
        assert!((slips.noticed_after_s.unwrap() - 6e-3).abs() < 1e-12, "{slips:?}");
    }
}
