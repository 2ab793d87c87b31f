//! The figures of a run, each against its bound.

use super::{DemoError, Run};
use fingertip::params::Params;
use host_tests::metrics::{self, DriveLimits, Sample, Step, Touch};
use host_tests::plant::Setup;
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
        let setup = Setup::default();
        let limits = DriveLimits {
            volts: f64::from(Params::DEFAULT.voltage_max_mv) * 1e-3,
            amperes: f64::from(Params::DEFAULT.current_max_ma) * 1e-3,
        };
        let mut touch = None;
        let mut steps = Vec::new();
        let mut release = None;
        for (place, (from_s, goal_n)) in run.goals.iter().enumerate() {
            let to_s = run.goals.get(place + 1).map_or(f64::INFINITY, |(next_s, _)| *next_s);
            let stretch = metrics::stretch(&run.trace, *from_s, to_s);
            if place == 0 {
                touch = Some(metrics::touch(stretch)?);
            } else if *goal_n > 0.0 {
                steps.push(metrics::step(stretch, &setup, limits)?);
            } else {
                release = Some(Release::of(stretch, &setup));
            }
        }
        let (touch, release) = touch.zip(release).ok_or(DemoError::Script)?;
        Ok(Self { touch, steps, release })
    }

    /// Each figure against its bound.
    pub fn checks(&self) -> Vec<Check> {
        let at_most = |most: f64| [None, Some(most)];
        let within = |least: f64, most: f64| [Some(least), Some(most)];
        let touch = &self.touch;
        let mut checks = vec![
            Check::new("first touch: way before it", Some(touch.distance_mm), "mm", within(4.9, 5.1)),
            Check::new("first touch: speed", Some(touch.approach_mm_per_s), "mm/s", within(20.0, 100.0)),
            Check::new("first touch: peak above goal", Some(touch.peak_above_goal_percent), "%", within(-1.0, 10.0)),
            Check::new(
                "first touch: steady error",
                Some(touch.steady_error_mn),
                "mN",
                at_most(steady_mn(touch.goal_n)),
            ),
        ];
        for step in &self.steps {
            let name = |what: &str| format!("{:.1} to {:.1} N: {what}", step.from_n, step.to_n);
            let ratio = step.settling_to_optimal_ratio;
            checks.extend([
                Check::new(name("rise, 10 to 90 %"), Some(step.rise_ms), "ms", within(1.0, 20.0)),
                Check::new(name("overshoot"), Some(step.overshoot_percent), "%", at_most(2.0)),
                Check::new(name("settled to 2 %"), step.settling_ms, "ms", within(1.0, 40.0)),
                Check::new(name("settling over time-optimal"), ratio, "", within(0.8, 2.0)),
                Check::new(name("steady error"), Some(step.steady_error_mn), "mN", at_most(steady_mn(step.to_n))),
            ]);
        }
        checks.push(Check::new("release: lets go after", self.release.clear_after_ms, "ms", within(1.0, 100.0)));
        checks.push(Check::new("release: clearance", Some(self.release.clearance_mm), "mm", within(0.5, 1.5)));
        checks
    }
}

impl Release {
    fn of(stretch: &[Sample], setup: &Setup) -> Self {
        let clear = stretch.iter().rposition(|sample| sample.true_force_n > 0.0).map_or(0, |last| last + 1);
        let clear_after_ms = stretch.get(clear).zip(stretch.first()).map(|(at, from)| (at.time_s - from.time_s) * 1e3);
        let travel_mm = stretch.last().map_or(f64::NAN, |sample| sample.travel_mm);
        Self { clear_after_ms, clearance_mm: setup.wall.distance_mm - travel_mm }
    }
}

/// The steady error allowed: 0.5 % and 5 mN.
fn steady_mn(goal_n: f64) -> f64 {
    goal_n * 5.0 + 5.0
}
