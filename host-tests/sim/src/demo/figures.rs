//! The figures of a run, each against its bound.

use super::{Asked, DemoError, Run};
use crate::optimal::minimum_time_s;
use crate::setup::Setup;
use fingertip::params::Params;
use output::plot::Sample;
use serde::Serialize;

/// Figures of the true force.
#[derive(Clone, Debug, Serialize)]
pub struct Forces {
    /// The first touch.
    pub touch: Touch,
    /// The force steps.
    pub steps: Vec<Step>,
    /// Letting go.
    pub release: Release,
}

/// The first touch of an object.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Touch {
    /// The force asked for.
    pub goal_n: f64,
    /// From the goal to the touch.
    pub touched_after_ms: f64,
    /// Speed just before the touch.
    pub approach_mm_per_s: Option<f64>,
    /// Travel from the goal to the touch.
    pub distance_mm: f64,
    /// Largest force.
    pub peak_n: f64,
    /// How far that is above the goal.
    pub peak_above_goal_percent: f64,
    /// From the touch until the force stays within 2 % of the goal; none where it does not.
    pub settled_after_touch_ms: Option<f64>,
    /// Largest error from 100 ms after the touch on.
    pub steady_error_mn: Option<f64>,
}

/// A step from one force to another.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Step {
    /// True force when the goal changed.
    pub from_n: f64,
    /// The force asked for.
    pub to_n: f64,
    /// From 10 % to 90 % of the step; none where the force does not get there.
    pub rise_ms: Option<f64>,
    /// Beyond the goal, of the goal or of the step, whichever is smaller.
    pub overshoot_percent: Option<f64>,
    /// Until the force stays within 2 % of the goal or of the step, whichever is smaller; none where it does not.
    pub settling_ms: Option<f64>,
    /// Largest error from 100 ms after the goal changed on.
    pub steady_error_mn: Option<f64>,
    /// The least time in which the motor can do it from rest to rest.
    pub time_optimal_ms: f64,
    /// Settling over that.
    pub settling_to_optimal_ratio: Option<f64>,
}

/// Letting go.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Release {
    /// From the goal of 0 until nothing is touched for good; none where something still is.
    pub clear_after_ms: Option<f64>,
    /// How far from the object the tip ends.
    pub clearance_mm: f64,
}

/// A figure against its bound.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is measured.
    pub name: String,
    /// The figure; none where there is none, which fails.
    pub measured: Option<f64>,
    /// Its unit.
    pub unit: &'static str,
    /// It must not be less; a figure too good to be true fails too.
    pub at_least: Option<f64>,
    /// It must not be more.
    pub at_most: Option<f64>,
    /// Whether it is so.
    pub pass: bool,
}

impl Check {
    /// Measures a figure against its bounds, at least and at most.
    pub fn new(name: impl Into<String>, measured: Option<f64>, unit: &'static str, bounds: [Option<f64>; 2]) -> Self {
        let [at_least, at_most] = bounds;
        let inside =
            |value: f64| at_least.is_none_or(|least| value >= least) && at_most.is_none_or(|most| value <= most);
        Self { name: name.into(), measured, unit, at_least, at_most, pass: measured.is_some_and(inside) }
    }
}

/// How many bounds are missed.
pub fn missed(checks: &[Check]) -> usize {
    checks.iter().filter(|check| !check.pass).count()
}

impl Forces {
    /// Takes the figures of a run.
    ///
    /// # Errors
    /// The run was not what the script asked for: nothing was touched, or a force never reached.
    pub fn of(run: &Run) -> Result<Self, DemoError> {
        let (mut touch, mut steps, mut release) = (None, Vec::new(), None);
        for (place, asked) in run.goals.iter().enumerate() {
            let to_s = run.goals.get(place + 1).map_or(f64::INFINITY, |next| next.at_s);
            let samples = run.between(asked.at_s, to_s);
            if place == 0 {
                touch = Touch::of(asked, samples);
            } else if asked.goal_n > 0.0 {
                steps.push(Step::of(asked)?);
            } else {
                release = Some(Release::of(samples));
            }
        }
        let (touch, release) = touch.zip(release).ok_or(DemoError::NoTouch)?;
        Ok(Self { touch, steps, release })
    }

    /// Each figure against its bound.
    pub fn checks(&self) -> Vec<Check> {
        let at_most = |most: f64| [None, Some(most)];
        let within = |least: f64, most: f64| [Some(least), Some(most)];
        let touch = &self.touch;
        let mut checks = vec![
            Check::new("first touch: way before it", Some(touch.distance_mm), "mm", within(4.9, 5.1)),
            Check::new("first touch: speed", touch.approach_mm_per_s, "mm/s", within(20.0, 100.0)),
            Check::new("first touch: peak above goal", Some(touch.peak_above_goal_percent), "%", within(-1.0, 10.0)),
            Check::new("first touch: steady error", touch.steady_error_mn, "mN", at_most(steady_mn(touch.goal_n))),
        ];
        for step in &self.steps {
            let name = |what: &str| format!("{:.1} to {:.1} N: {what}", step.from_n, step.to_n);
            let ratio = step.settling_to_optimal_ratio;
            checks.extend([
                Check::new(name("rise, 10 to 90 %"), step.rise_ms, "ms", within(1.0, 20.0)),
                Check::new(name("overshoot"), step.overshoot_percent, "%", at_most(2.0)),
                Check::new(name("settled to 2 %"), step.settling_ms, "ms", within(1.0, 40.0)),
                Check::new(name("settling over time-optimal"), ratio, "", within(0.8, 2.0)),
                Check::new(name("steady error"), step.steady_error_mn, "mN", at_most(steady_mn(step.to_n))),
            ]);
        }
        checks.push(Check::new("release: lets go after", self.release.clear_after_ms, "ms", within(1.0, 100.0)));
        checks.push(Check::new("release: clearance", Some(self.release.clearance_mm), "mm", within(0.5, 1.5)));
        checks
    }
}

impl Touch {
    /// None where nothing is touched.
    fn of(asked: &Asked, samples: &[Sample]) -> Option<Self> {
        let measured = asked.meter.measured();
        let touched = samples.iter().find(|sample| sample.true_force_n > 0.0)?;
        let peak_n = measured.get("peak_force_n")?;
        Some(Self {
            goal_n: asked.goal_n,
            touched_after_ms: (touched.time_s - asked.at_s) * 1e3,
            approach_mm_per_s: measured.get("approach_mm_per_s"),
            distance_mm: touched.travel_mm - samples[0].travel_mm,
            peak_n,
            peak_above_goal_percent: (peak_n / asked.goal_n - 1.0) * 100.0,
            settled_after_touch_ms: measured.get("settling_ms"),
            steady_error_mn: measured.get("steady_error_max_mn"),
        })
    }
}

impl Step {
    fn of(asked: &Asked) -> Result<Self, DemoError> {
        let setup = Setup::default();
        let [volts, amperes] =
            [Params::DEFAULT.voltage_max_mv, Params::DEFAULT.current_max_ma].map(|milli| f64::from(milli) * 1e-3);
        let [d_from_mm, d_to_mm] = [asked.from_n, asked.goal_n].map(|force_n| setup.tip.indentation_mm(force_n));
        let time_optimal_ms = minimum_time_s(&setup, d_from_mm, d_to_mm, volts, amperes)? * 1e3;
        let measured = asked.meter.measured();
        let settling_ms = measured.get("settling_ms");
        Ok(Self {
            from_n: asked.from_n,
            to_n: asked.goal_n,
            rise_ms: measured.get("rise_ms"),
            overshoot_percent: measured.get("overshoot_percent"),
            settling_ms,
            steady_error_mn: measured.get("steady_error_max_mn"),
            time_optimal_ms,
            settling_to_optimal_ratio: settling_ms.map(|ms| ms / time_optimal_ms),
        })
    }
}

impl Release {
    fn of(stretch: &[Sample]) -> Self {
        let clear = stretch.iter().rposition(|sample| sample.true_force_n > 0.0).map_or(0, |last| last + 1);
        let clear_after_ms = stretch.get(clear).zip(stretch.first()).map(|(at, from)| (at.time_s - from.time_s) * 1e3);
        let travel_mm = stretch.last().map_or(f64::NAN, |sample| sample.travel_mm);
        Self { clear_after_ms, clearance_mm: Setup::default().wall.distance_mm - travel_mm }
    }
}

/// The steady error allowed: 0.5 % and 5 mN.
fn steady_mn(goal_n: f64) -> f64 {
    goal_n * 5.0 + 5.0
}
