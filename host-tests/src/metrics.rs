//! The figures of a run: how a touch and a force step are judged, from a trace of what the world and the controller
//! did.
//!
//! Every figure is of the true contact force, which only the simulated world knows; the sensed one is kept beside it.

mod response;

pub use response::Response;

use crate::optimal::{Unreachable, minimum_time_s};
use crate::plant::Setup;
use fingertip::state::Mode;

/// A step counts as settled inside this share of the goal or of the step, whichever is smaller.
pub const SETTLED_SHARE: f64 = 0.02;
/// The steady error is judged from this long after the goal changed.
pub const STEADY_AFTER_S: f64 = 0.1;
/// The approach speed is the mean over this last stretch before the touch.
const APPROACH_S: f64 = 0.01;

/// The world and the controller at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// When.
    pub time_s: f64,
    /// The force asked for.
    pub goal_n: f64,
    /// The contact force as it is.
    pub true_force_n: f64,
    /// The contact force as the controller senses it.
    pub sensed_force_n: f64,
    /// How far the tip has come.
    pub travel_mm: f64,
    /// Indentation of the tip.
    pub indentation_mm: f64,
    /// Share of the supply at the motor, -1 to 1; positive presses.
    pub duty: f64,
    /// What the controller is doing.
    pub mode: Mode,
}

/// What the motor may be driven with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveLimits {
    /// Largest voltage at the motor.
    pub volts: f64,
    /// Largest current.
    pub amperes: f64,
}

/// The first touch of an object.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Touch {
    /// The force asked for.
    pub goal_n: f64,
    /// From the goal to the touch.
    pub touched_after_ms: f64,
    /// Speed just before the touch.
    pub approach_mm_per_s: f64,
    /// Travel from the goal to the touch.
    pub distance_mm: f64,
    /// Largest force.
    pub peak_n: f64,
    /// How far that is above the goal.
    pub peak_above_goal_percent: f64,
    /// From the touch until the force stays within 2 % of the goal; none where it does not.
    pub settled_after_touch_ms: Option<f64>,
    /// Largest error from 100 ms after the touch on.
    pub steady_error_mn: f64,
}

/// A step from one force to another.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Step {
    /// True force when the goal changed.
    pub from_n: f64,
    /// The force asked for.
    pub to_n: f64,
    /// From 10 % to 90 % of the step.
    pub rise_ms: f64,
    /// Beyond the goal, of the goal or of the step, whichever is smaller.
    pub overshoot_percent: f64,
    /// Until the force stays within 2 % of the goal or of the step, whichever is smaller; none where it does not.
    pub settling_ms: Option<f64>,
    /// Largest error from 100 ms after the goal changed on.
    pub steady_error_mn: f64,
    /// The least time in which the motor can do it from rest to rest.
    pub time_optimal_ms: f64,
    /// Settling over that.
    pub settling_to_optimal_ratio: Option<f64>,
}

/// A trace that the figures cannot be taken from.
#[derive(Clone, Debug, PartialEq)]
pub enum MetricsError {
    /// Fewer than two samples between two instants.
    TooShort {
        /// From.
        from_s: f64,
        /// To.
        to_s: f64,
    },
    /// Nothing is touched.
    NoTouch,
    /// The force never comes to 90 % of the way.
    NoRise {
        /// Where it came from.
        from_n: f64,
        /// Where it was to go.
        to_n: f64,
    },
    /// The motor cannot do the step at all.
    Unreachable(Unreachable),
}

impl core::fmt::Display for MetricsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooShort { from_s, to_s } => {
                write!(f, "the trace has fewer than two samples in {from_s} to {to_s} s")
            }
            Self::NoTouch => write!(f, "the trace never touches the object"),
            Self::NoRise { from_n, to_n } => {
                write!(f, "the force never comes to 90 % of the way from {from_n} to {to_n} N")
            }
            Self::Unreachable(why) => write!(f, "no bound for the step: {why}"),
        }
    }
}

impl core::error::Error for MetricsError {}

/// The first touch, in the stretch of a trace that begins with its goal.
///
/// # Errors
/// The stretch is too short or has no touch.
pub fn touch(stretch: &[Sample]) -> Result<Touch, MetricsError> {
    let (first, last) = ends(stretch)?;
    let at = stretch.iter().position(|sample| sample.true_force_n > 0.0).ok_or(MetricsError::NoTouch)?;
    let (before, after) = stretch.split_at(at);
    let touched = after[0];
    let start = before.iter().rfind(|sample| sample.time_s <= touched.time_s - APPROACH_S).unwrap_or(&first);
    let way_s = touched.time_s - start.time_s;
    let peak_n = after.iter().map(|sample| sample.true_force_n).fold(0.0, f64::max);
    let response = response(0.0, last.goal_n, after);
    Ok(Touch {
        goal_n: last.goal_n,
        touched_after_ms: (touched.time_s - first.time_s) * 1e3,
        approach_mm_per_s: if way_s > 0.0 { (touched.travel_mm - start.travel_mm) / way_s } else { 0.0 },
        distance_mm: touched.travel_mm - first.travel_mm,
        peak_n,
        peak_above_goal_percent: (peak_n / last.goal_n - 1.0) * 100.0,
        settled_after_touch_ms: response.settled_s().map(|s| s * 1e3),
        steady_error_mn: response.steady_max_n() * 1e3,
    })
}

/// A step, in the stretch of a trace that begins with its goal.
///
/// # Errors
/// The stretch is too short, the force does not get there, or the motor cannot do it.
pub fn step(stretch: &[Sample], setup: &Setup, limits: DriveLimits) -> Result<Step, MetricsError> {
    let (first, last) = ends(stretch)?;
    let (from_n, to_n) = (first.true_force_n, last.goal_n);
    let response = response(from_n, to_n, stretch);
    let [d_from_mm, d_to_mm] = [from_n, to_n].map(|force_n| setup.tip.indentation_mm(force_n));
    let optimal_s = minimum_time_s(setup, d_from_mm, d_to_mm, limits.volts, limits.amperes);
    let optimal_s = optimal_s.map_err(MetricsError::Unreachable)?;
    let settling_s = response.settled_s();
    Ok(Step {
        from_n,
        to_n,
        rise_ms: response.rise_s().ok_or(MetricsError::NoRise { from_n, to_n })? * 1e3,
        overshoot_percent: response.beyond_n() / response.unit_n() * 100.0,
        settling_ms: settling_s.map(|s| s * 1e3),
        steady_error_mn: response.steady_max_n() * 1e3,
        time_optimal_ms: optimal_s * 1e3,
        settling_to_optimal_ratio: settling_s.map(|s| s / optimal_s),
    })
}

/// The samples from one instant to before another.
pub fn stretch(trace: &[Sample], from_s: f64, to_s: f64) -> &[Sample] {
    let start = trace.partition_point(|sample| sample.time_s < from_s);
    let end = trace.partition_point(|sample| sample.time_s < to_s);
    &trace[start..end.max(start)]
}

fn ends(stretch: &[Sample]) -> Result<(Sample, Sample), MetricsError> {
    match stretch {
        [first, .., last] => Ok((*first, *last)),
        [only] => Err(MetricsError::TooShort { from_s: only.time_s, to_s: only.time_s }),
        [] => Err(MetricsError::TooShort { from_s: 0.0, to_s: 0.0 }),
    }
}

fn response(from_n: f64, goal_n: f64, samples: &[Sample]) -> Response {
    let mut response = Response::new(from_n, goal_n);
    samples.iter().for_each(|sample| response.add(sample.time_s, sample.true_force_n));
    response
}
