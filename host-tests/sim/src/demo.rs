//! Demonstration: a scene of a touch, four force steps and a release, measured by the true force, and drawn.
//!
//! It runs on the native board and, in the package `virtual-board`, on the flash image. [`Trace`] watches both and
//! keeps the goals, the world at every frame, and the array at the end of each hold.

pub mod figures;

pub use crate::demo::figures::{Check, Forces};

use crate::metrics::{self, Meter, newtons};
use crate::run::RunError;
use crate::scene::{Scene, library, read};
use crate::watch::{Controller, Step, Watch};
use fingertip::shipped::{COLUMNS, Frame, SLOTS};
use fingertip::state::Fault;
use output::heatmap::Pressures;
use output::plot::Sample;

const SCENE: &str = "demo";
/// Duration of the goals in the quick run: of the first, which includes the approach, and of the others.
const QUICK_S: [f64; 2] = [0.5, 0.25];

/// Array at the end of a hold, with the contact that the controller sensed.
#[derive(Clone, Copy, Debug)]
pub struct HeldImage {
    pub goal_n: f64,
    pub force_n: f64,
    /// Centre of the contact, along columns and rows.
    pub centre_mm: [f64; 2],
    pub radius_mm: f64,
    pub pressures_kpa: Pressures,
}

#[derive(Clone, Debug)]
pub struct Asked {
    /// Time at which the goal reached the controller.
    pub at_s: f64,
    pub goal_n: f64,
    pub from_n: f64,
    /// Measurement until the next goal.
    pub meter: Meter,
}

#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Goals in order.
    pub goals: Vec<Asked>,
    /// State of the world at each frame.
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

/// Reason why the demonstration has no result.
pub type DemoError = RunError;

/// Returns the scene. The quick one holds the same goals for a shorter time.
pub fn scene(quick: bool) -> Result<Scene, DemoError> {
    let (path, text) = library::text(SCENE)?;
    let mut scene = read(&path.to_string_lossy(), &text, &metrics::names())?;
    if quick {
        scene.duration_s = 0.0;
        for (place, event) in scene.script.iter_mut().enumerate() {
            event.at_s = scene.duration_s;
            scene.duration_s += QUICK_S[place.min(1)];
        }
    }
    Ok(scene)
}

pub fn what(goal_n: f64) -> String {
    if goal_n > 0.0 { format!("hold {goal_n} N") } else { "let go".into() }
}

/// Smallest force of a hold that is drawn. Each force is drawn once.
const DRAWN_N: f64 = 1.0;

/// Watches the demonstration's scene.
#[derive(Clone, Debug)]
pub struct Trace {
    array: Taxels,
    run: Run,
    controllers: Vec<Controller>,
    /// Last tactile image under the last goal.
    last: Option<HeldImage>,
    fault: Option<Fault>,
}

impl Trace {
    /// Creates the watcher of a run of this scene.
    pub fn new(scene: &Scene) -> Self {
        Self { array: Taxels::of(scene), run: Run::default(), controllers: Vec::new(), last: None, fault: None }
    }

    pub fn finish(mut self) -> Result<Run, DemoError> {
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
            centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
            radius_mm: contact.radius.0.to_num(),
            pressures_kpa: self.array.kilopascals(step.frame),
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
    /// Conversion for the array of a scene.
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
