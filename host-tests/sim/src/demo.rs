//! Demonstration: a scene of a touch, four force steps and a release, measured by the true force, and drawn.
//!
//! It runs on the native board and, in the package `virtual-board`, on the flash image. [`Trace`] watches both and
//! keeps the goals, the world at every frame, and the array at the end of each hold.

use crate::mechanics::rotor::profile;
use crate::metrics::{Meter, newtons, shown};
use crate::run::{RunError, asked};
use crate::scene::{self, Scene, read};
use crate::setup::Setup;
use crate::watch::{Controller, Step, Watch};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Frame, SLOTS};
use fingertip::state::Fault;
use output::plot::{self, Map, Panel, Pressures, Sample};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const SCENE: &str = "demo";
/// Duration of the goals in the quick run: of the first, which includes the approach, and of the others.
const QUICK_S: [f64; 2] = [0.5, 0.25];

/// Array at the end of a hold, with the contact that the controller sensed.
#[derive(Clone, Debug)]
pub struct HeldImage {
    pub goal_n: f64,
    pub force_n: f64,
    pub map: Map,
}

#[derive(Clone, Debug)]
pub struct Asked {
    /// Time at which the goal reached the controller.
    pub at_s: f64,
    pub goal_n: f64,
    pub from_n: f64,
    pub meter: Meter,
}

#[derive(Clone, Debug, Default)]
pub struct Run {
    pub goals: Vec<Asked>,
    pub trace: Vec<Sample>,
    pub pictures: Vec<HeldImage>,
    /// Frames that the controller missed, by its own count.
    pub missed_frames: u32,
}

impl Run {
    /// Returns the samples from one time to before another.
    pub fn between(&self, from_s: f64, to_s: f64) -> &[Sample] {
        let [start, end] = [from_s, to_s].map(|at_s| self.trace.partition_point(|sample| sample.time_s < at_s));
        &self.trace[start..end.max(start)]
    }
}

/// Returns the scene. The quick one holds the same goals for a shorter time.
pub fn scene(quick: bool) -> Result<Scene, RunError> {
    let (path, text) = scene::library_text(SCENE)?;
    let mut scene = read(&path.to_string_lossy(), &text)?;
    if quick {
        scene.duration_s = 0.0;
        for (place, event) in scene.script.iter_mut().enumerate() {
            event.at_s = scene.duration_s;
            scene.duration_s += QUICK_S[place.min(1)];
        }
    }
    Ok(scene)
}

/// Smallest force of a hold that is drawn. Each force is drawn once.
const DRAWN_N: f64 = 1.0;

/// Watches the demonstration's scene.
#[derive(Clone, Debug)]
pub struct Trace {
    array: Taxels,
    run: Run,
    controllers: Vec<Controller>,
    last: Option<HeldImage>,
    fault: Option<Fault>,
}

impl Trace {
    pub fn new(scene: &Scene) -> Self {
        Self { array: Taxels::of(scene), run: Run::default(), controllers: Vec::new(), last: None, fault: None }
    }

    pub fn finish(mut self) -> Result<Run, RunError> {
        self.keep();
        match self.fault {
            Some(fault) => Err(format!("the controller stopped with fault {}", fault as u8).into()),
            None => Ok(self.run),
        }
    }

    /// Keeps the tactile image of a hold that is over.
    fn keep(&mut self) {
        let last = self.last.take().filter(|last| last.goal_n >= DRAWN_N);
        let known = |new: &HeldImage| self.run.pictures.iter().any(|picture| picture.goal_n == new.goal_n);
        if let Some(new) = last.filter(|new| !known(new)) {
            self.run.pictures.push(new);
        }
    }
}

impl Watch for Trace {
    fn wants_every_frame(&self) -> bool {
        true
    }

    fn begin(&mut self, controllers: &[Controller]) {
        self.controllers = controllers.to_vec();
    }

    fn step(&mut self, step: &Step) {
        let (truth, status) = (step.truth, step.status);
        // The requested goal, in whole mN.
        let goal_n = (newtons(step.command.goal) * 1e3).round() / 1e3;
        let known_n = self.run.goals.last().map_or(0.0, |asked| asked.goal_n);
        if goal_n != known_n {
            self.keep();
            let mut meter = Meter::default();
            meter.begin(&self.controllers);
            self.run.goals.push(Asked { at_s: step.time_s, goal_n, from_n: truth.force_n, meter });
        }
        let Some(asked) = self.run.goals.last_mut() else { return };
        asked.meter.step(step);
        self.fault = self.fault.or(status.fault);
        self.run.missed_frames = status.missed_frames;
        self.run.trace.push(Sample {
            time_s: step.time_s,
            goal_n,
            true_force_n: truth.force_n,
            travel_mm: truth.travel_mm,
            indentation_mm: truth.indentation_mm,
            duty: truth.duty,
        });
        let contact = &status.contact;
        self.last = Some(HeldImage {
            goal_n,
            force_n: newtons(contact.force),
            map: Map {
                title: format!("{goal_n} N"),
                pressures_kpa: self.array.kilopascals(step.frame),
                centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
                radius_mm: contact.radius.0.to_num(),
            },
        });
    }
}

/// Conversion of the codes of a frame to pressures, by the parameters of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Taxels {
    preload_codes: f64,
    codes_per_kpa: f64,
    sag_per_code: f64,
}

impl Taxels {
    pub fn of(scene: &Scene) -> Self {
        let params = scene.params();
        Self {
            preload_codes: scene.table("array").number("preload_codes"),
            codes_per_kpa: f64::from(params.codes_per_kpa_milli) * 1e-3,
            sag_per_code: f64::from(params.row_sag_ppb_per_code) * 1e-9,
        }
    }

    /// Returns the pressures of a frame as `fingertip::pressure` does: n codes in a row of N become n / (1 - rho N).
    pub fn kilopascals(&self, frame: &Frame) -> Pressures {
        core::array::from_fn(|row| {
            let net: [f64; COLUMNS] = core::array::from_fn(|column| {
                f64::from(frame.code(row, column)) - f64::from(frame.code(SLOTS - 1, column))
            });
            let boost = 1.0 / (1.0 - self.sag_per_code * net.iter().sum::<f64>());
            net.map(|codes| ((codes * boost - self.preload_codes) / self.codes_per_kpa).max(0.0))
        })
    }
}

// Figures of a run against their bounds, as a table and as pictures.

#[derive(Clone, Debug, Serialize)]
pub struct Forces {
    pub touch: Touch,
    pub steps: Vec<StepFigures>,
    pub release: Release,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Touch {
    pub goal_n: f64,
    pub touched_after_ms: f64,
    pub approach_mm_per_s: Option<f64>,
    pub distance_mm: f64,
    pub peak_n: f64,
    pub peak_above_goal_percent: f64,
    /// Time from the touch until the force stays within 2 % of the goal; none if it never does.
    pub settled_after_touch_ms: Option<f64>,
    /// Largest error later than 100 ms after the touch.
    pub steady_error_mn: Option<f64>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct StepFigures {
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
    pub settling_to_optimal_ratio: Option<f64>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub struct Release {
    /// Time from the goal of 0 to the end of the last contact; none while something is touched.
    pub clear_after_ms: Option<f64>,
    pub clearance_mm: f64,
}

#[derive(Clone, Debug, Serialize)]
pub struct Check {
    pub name: String,
    /// Measured value; none if the run has none, which fails.
    pub measured: Option<f64>,
    pub unit: &'static str,
    /// Lower bound: a figure too good to be true fails too.
    pub at_least: Option<f64>,
    pub at_most: Option<f64>,
    pub pass: bool,
}

impl Check {
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
    pub fn of(run: &Run) -> Result<Self, RunError> {
        let (mut touch, mut steps, mut release) = (None, Vec::new(), None);
        for (place, asked) in run.goals.iter().enumerate() {
            let to_s = run.goals.get(place + 1).map_or(f64::INFINITY, |next| next.at_s);
            let samples = run.between(asked.at_s, to_s);
            if place == 0 {
                touch = Touch::of(asked, samples);
            } else if asked.goal_n > 0.0 {
                steps.push(StepFigures::of(asked)?);
            } else {
                release = Some(Release::of(samples));
            }
        }
        let (touch, release) = touch.zip(release).ok_or("nothing was touched, or it was not let go")?;
        Ok(Self { touch, steps, release })
    }

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

impl StepFigures {
    fn of(asked: &Asked) -> Result<Self, RunError> {
        let setup = Setup::default();
        let [volts, amperes] =
            [Params::DEFAULT.voltage_max_mv, Params::DEFAULT.current_max_ma].map(|milli| f64::from(milli) * 1e-3);
        let d_mm = [asked.from_n, asked.goal_n].map(|force_n| setup.tip.indentation_mm(force_n));
        let optimal = profile(&setup, d_mm, volts, amperes);
        let no_bound = |why| format!("no bound for a step of the indentation over {d_mm:?} mm: {why}");
        let time_optimal_ms = 1e3 * optimal.map_err(no_bound)?.total_s;
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

/// Returns all checks as a table.
pub fn table(checks: &[Check]) -> String {
    let mut text = format!("{:<44} {:>12} {:<5} {:>16}\n", "", "measured", "", "bound");
    for check in checks {
        let measured = check.measured.map_or_else(|| "never".to_owned(), |value| shown(Some(value)));
        let verdict = if check.pass { "pass" } else { "FAIL" };
        let bound = asked(check.at_least, check.at_most);
        let _ = writeln!(text, "{:<44} {measured:>12} {:<5} {bound:>16}  {verdict}", check.name, check.unit);
    }
    text
}

/// Time shown before and after the goal of a step.
const BEFORE_MS: f64 = 5.0;
const AFTER_MS: f64 = 60.0;

/// Draws the pictures into a folder and returns their paths.
pub fn draw(run: &Run, forces: &Forces, folder: &Path) -> Result<Vec<PathBuf>, RunError> {
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
    let mut images = run.pictures.clone();
    images.sort_by(|a, b| a.goal_n.total_cmp(&b.goal_n));
    let maps: Vec<Map> = images.into_iter().map(|image| image.map).collect();
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
