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

use crate::metrics;
use crate::scene::{Scene, library, read};
use host_tests::heatmap::Pressures;
use host_tests::metrics::{MetricsError, Sample};
use host_tests::plot::PlotError;
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

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// When each goal reached the controller, and the goal.
    pub goals: Vec<(f64, f64)>,
    /// The world.
    pub trace: Vec<Sample>,
    /// Pressure maps.
    pub pictures: Vec<Picture>,
    /// Frames that the controller says it missed.
    pub missed_frames: u32,
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
    /// The run has no figures.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// The script has no touch or no release.
    #[error("the script has no touch or no release")]
    Script,
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
