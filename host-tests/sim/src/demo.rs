//! The demonstration: a scene of a touch, four force steps and letting go, judged step by step by the true force, and drawn.
//!
//! It runs on the native board and, in the package `virtual-board`, on the flash image. [`Trace`] watches either, and the same figures,
//! table and pictures come of it.

pub mod figures;
pub mod pictures;
pub mod table;
mod trace;

pub use figures::{Check, Forces};
pub use trace::{Taxels, Trace};

use crate::metrics::{self, Meter};
use crate::optimal::Unreachable;
use crate::scene::{Scene, library, read};
use output::heatmap::Pressures;
use output::plot::{PlotError, Sample};
use std::path::PathBuf;

/// The scene's name in the library.
const SCENE: &str = "demo";
/// How long goals stand in the quick run: the first, which has a way to go, and the others.
const QUICK_S: [f64; 2] = [0.5, 0.25];

/// The array at the end of a hold, and what the controller made of it.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    /// The force asked for.
    pub goal_n: f64,
    /// Sensed force.
    pub force_n: f64,
    /// Centre of the contact, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Contact radius.
    pub radius_mm: f64,
    /// Pressures by the frame's codes.
    pub pressures_kpa: Pressures,
}

/// A goal and what came of it.
#[derive(Clone, Debug)]
pub struct Asked {
    /// When it reached the controller.
    pub at_s: f64,
    /// The force asked for.
    pub goal_n: f64,
    /// The true force then.
    pub from_n: f64,
    /// What is measured until the next one.
    pub meter: Meter,
}

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// The goals.
    pub goals: Vec<Asked>,
    /// The world.
    pub trace: Vec<Sample>,
    /// Pressure maps.
    pub pictures: Vec<Picture>,
    /// Frames that the controller says it missed.
    pub missed_frames: u32,
}

impl Run {
    /// The samples from one instant to before another.
    pub fn between(&self, from_s: f64, to_s: f64) -> &[Sample] {
        let [start, end] = [from_s, to_s].map(|at_s| self.trace.partition_point(|sample| sample.time_s < at_s));
        &self.trace[start..end.max(start)]
    }
}

/// The demonstration has no result.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// Its scene is broken.
    #[error("{0}")]
    Scene(String),
    /// It cannot be simulated.
    #[error(transparent)]
    Simulated(#[from] crate::SimError),
    /// The run has no touch or no release.
    #[error("nothing was touched, or it was not let go")]
    NoTouch,
    /// The motor cannot do a step at all.
    #[error("no bound for a step: {0}")]
    Unreachable(#[from] Unreachable),
    /// The controller stopped with this fault.
    #[error("the controller stopped with fault {0}")]
    Fault(u8),
    /// A picture could not be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// The scene; quick, with the same goals held for a shorter time.
///
/// # Errors
/// It is not where it was when this was compiled, or is broken.
pub fn scene(quick: bool) -> Result<Scene, DemoError> {
    let (path, text) = library::text(SCENE).map_err(DemoError::Scene)?;
    let scene = read(&path.to_string_lossy(), &text, &metrics::names());
    let mut scene = scene.map_err(|errors| DemoError::Scene(errors.to_string()))?;
    if quick {
        scene.duration_s = 0.0;
        for (place, event) in scene.script.iter_mut().enumerate() {
            event.at_s = scene.duration_s;
            scene.duration_s += QUICK_S[place.min(1)];
        }
    }
    Ok(scene)
}

/// What a goal asks for, in words.
pub fn what(goal_n: f64) -> String {
    if goal_n > 0.0 { format!("hold {goal_n} N") } else { "let go".into() }
}
