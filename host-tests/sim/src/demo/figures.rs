//! Figures of a run against their bounds, as a table and as pictures.

use crate::demo::{Asked, DemoError, HeldImage, Run};
use crate::optimal::minimum_time_s;
use crate::setup::Setup;
use fingertip::params::Params;
use output::plot::{self, Map, Panel, Sample};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Figures of the true force.
#[derive(Clone, Debug, Serialize)]
pub struct Forces {
    pub touch: Touch,
    pub steps: Vec<Step>,
    pub release: Release,
}

/// The first touch of an object.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Touch {
    pub goal_n: f64,
    /// Time from the goal to the touch.
    pub touched_after_ms: f64,
    /// Speed just before the touch.
    pub approach_mm_per_s: Option<f64>,
    pub distance_mm: f64,
    pub peak_n: f64,
    pub peak_above_goal_percent: f64,
    /// Time from the touch until the force stays within 2 % of the goal; none if it never does.
    pub settled_after_touch_ms: Option<f64>,
    /// Largest error later than 100 ms after the touch.
    pub steady_error_mn: Option<f64>,
}

/// A step from one force to another.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Step {
    /// True force when the goal changed.
    pub from_n: f64,
    pub to_n: f64,
    /// Time from 10 % to 90 % of the step; none if the force does not reach 90 %.
    pub rise_ms: Option<f64>,
    /// Largest force beyond the goal, as a share of the goal or of the step, whichever is smaller.
    pub overshoot_percent: Option<f64>,
    /// Time until the force stays within 2 % of the goal or of the step, whichever is smaller; none if it never does.
    pub settling_ms: Option<f64>,
    /// Largest error later than 100 ms after the change of the goal.
    pub steady_error_mn: Option<f64>,
    /// Shortest time in which the motor can do the step from rest to rest.
    pub time_optimal_ms: f64,
    /// Settling time over the shortest possible time.
    pub settling_to_optimal_ratio: Option<f64>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Release {
    /// Time from the goal of 0 to the end of the last contact; none while something is touched.
    pub clear_after_ms: Option<f64>,
    /// Distance of the tip from the object at the end.
    pub clearance_mm: f64,
}

/// Figure and its bounds.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    pub name: String,
    /// Measured value; none if the run has none, which fails.
    pub measured: Option<f64>,
    pub unit: &'static str,
    /// Lower bound: a figure too good to be true fails too.
    pub at_least: Option<f64>,
    pub at_most: Option<f64>,
    /// True if the figure lies within its bounds.
    pub pass: bool,
}

impl Check {
    /// Compares a figure with its bounds, lower and upper.
    pub fn new(name: impl Into<String>, measured: Option<f64>, unit: &'static str, bounds: [Option<f64>; 2]) -> Self {
        let [at_least, at_most] = bounds;
        let inside =
            |value: f64| at_least.is_none_or(|least| value >= least) && at_most.is_none_or(|most| value <= most);
        Self { name: name.into(), measured, unit, at_least, at_most, pass: measured.is_some_and(inside) }
    }
}

pub fn missed(checks: &[Check]) -> usize {
    checks.iter().filter(|check| !check.pass).count()
}

impl Forces {
    /// Takes the figures of a run.
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
        let (touch, release) = touch.zip(release).ok_or("nothing was touched, or it was not let go")?;
        Ok(Self { touch, steps, release })
    }

    /// Compares each figure with its bounds.
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
        let time_optimal_s = minimum_time_s(&setup, d_from_mm, d_to_mm, volts, amperes);
        let time_optimal_ms = 1e3 * time_optimal_s.map_err(|why| format!("no bound for a step: {why}"))?;
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

/// Allowed steady error: 0.5 % and 5 mN.
fn steady_mn(goal_n: f64) -> f64 {
    goal_n * 5.0 + 5.0
}

/// Returns all checks as a table, and the time of each step over the shortest possible one.
pub fn table(checks: &[Check], forces: &Forces) -> String {
    let mut text = format!("{:<44} {:>12} {:<5} {:>16}\n", "", "measured", "", "bound");
    for check in checks {
        let measured = check.measured.map_or_else(|| "never".to_owned(), number);
        let verdict = if check.pass { "pass" } else { "FAIL" };
        let _ = writeln!(text, "{:<44} {measured:>12} {:<5} {:>16}  {verdict}", check.name, check.unit, bound(check));
    }
    let _ = writeln!(text);
    for step in &forces.steps {
        let _ = writeln!(
            text,
            "{:.1} to {:.1} N: the motor at its limits needs {:.1} ms; the loop took {} times as long",
            step.from_n,
            step.to_n,
            step.time_optimal_ms,
            step.settling_to_optimal_ratio.map_or_else(|| "for ever, not".to_owned(), |ratio| format!("{ratio:.2}")),
        );
    }
    text
}

fn bound(check: &Check) -> String {
    match (check.at_least, check.at_most) {
        (Some(least), Some(most)) => format!("{} to {}", number(least), number(most)),
        (Some(least), None) => format!("at least {}", number(least)),
        (None, Some(most)) => format!("at most {}", number(most)),
        (None, None) => String::new(),
    }
}

/// Rounds to three decimals.
fn number(value: f64) -> String {
    let rounded = (value * 1e3).round() / 1e3 + 0.0;
    format!("{rounded}")
}

/// Time shown before and after the goal of a step.
const BEFORE_MS: f64 = 5.0;
const AFTER_MS: f64 = 60.0;

/// Draws the pictures into a folder and returns their paths.
pub fn draw(run: &Run, forces: &Forces, folder: &Path) -> Result<Vec<PathBuf>, DemoError> {
    let touched_s = run.goals.first().map_or(0.0, |asked| asked.at_s) + forces.touch.touched_after_ms * 1e-3;
    let window = |zero_s: f64| run.between(zero_s - 1e-3 * BEFORE_MS, zero_s + 1e-3 * AFTER_MS);
    let panel = |title, zero_s, time_optimal_ms| Panel {
        title,
        samples: window(zero_s),
        zero_s,
        shown_ms: [BEFORE_MS, AFTER_MS],
        time_optimal_ms,
    };
    let mut panels = vec![panel(format!("First touch, goal {} N", forces.touch.goal_n), touched_s, None)];
    for (step, asked) in forces.steps.iter().zip(run.goals.iter().skip(1)) {
        let title = format!("{:.1} to {:.1} N", step.from_n, step.to_n);
        panels.push(panel(title, asked.at_s, Some(step.time_optimal_ms)));
    }
    let map = |picture: &HeldImage| Map {
        title: format!("{} N", picture.goal_n),
        pressures_kpa: picture.pressures_kpa,
        centre_mm: picture.centre_mm,
        radius_mm: picture.radius_mm,
    };
    let mut maps: Vec<_> = run.pictures.iter().collect();
    maps.sort_by(|a, b| a.goal_n.total_cmp(&b.goal_n));
    let maps: Vec<_> = maps.into_iter().map(map).collect();
    let pictures = [
        ("run.svg", plot::overview(&run.trace)?),
        ("steps.svg", plot::steps(&panels)?),
        ("maps.svg", plot::maps(&maps, Setup::default().array.pitch_mm)?),
    ];

    let failed = |path: &Path, error| format!("cannot write {}: {error}", path.display());
    std::fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
    let write = |(name, svg): (&str, String)| {
        let path = folder.join(name);
        std::fs::write(&path, svg).map_err(|error| failed(&path, error))?;
        Ok(path)
    };
    pictures.into_iter().map(write).collect()
}
