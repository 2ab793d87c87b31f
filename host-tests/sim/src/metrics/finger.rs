//! Measurements of one finger, step by step. No trace is kept, so memory grows with the number of goals only.

use crate::metrics::conduct::Conduct;
use crate::metrics::response::{Response, Slips};
use crate::watch::{Controller, Step};
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
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Squares {
    sum: f64,
    time_s: f64,
    /// The largest magnitude.
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
    pub(super) fn of(controller: &Controller) -> Self {
        Self { conduct: Conduct::of(&controller.params), ..Self::default() }
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
        let largest_n = self.worst(|response| Some(response.steady_max_n))?;
        let sum = |(squares, samples), response: &Response| {
            (squares + response.steady_squares, samples + response.steady_samples)
        };
        let (squares, samples) = self.responses.iter().fold((0.0, 0), sum);
        (samples > 0).then(|| [largest_n, (squares / samples as f64).sqrt()])
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

/// True if a change of the goal is not a step to judge.
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
