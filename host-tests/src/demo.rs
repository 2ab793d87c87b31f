//! The demonstration: a touch, four force steps and letting go, judged by the true force.
//!
//! The same script runs on the native core ([`native`]) and, in the package `virtual-board`, on the flash image. Both
//! leave a [`Run`] behind, and the same figures, table and pictures come of it.

pub mod figures;
pub mod native;
pub mod pictures;
pub mod script;
pub mod table;

pub use figures::{Check, Forces};
pub use script::{Phase, Script};

use crate::heatmap::Pressures;
use crate::metrics::{MetricsError, Sample};
use crate::plot::PlotError;
use std::path::PathBuf;

/// The array at the end of a phase, and what the controller made of it.
#[derive(Clone, Copy, Debug)]
pub struct Picture {
    /// The phase's goal.
    pub goal_n: f64,
    /// Sensed force.
    pub force_n: f64,
    /// Centre of the contact, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Contact radius.
    pub radius_mm: f64,
    /// Pressures, kPa.
    pub pressures_kpa: Pressures,
}

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// When each phase's goal had reached the controller, and the goal.
    pub goals: Vec<(f64, f64)>,
    /// When torque was enabled and when it ended.
    pub span_s: [f64; 2],
    /// The world.
    pub trace: Vec<Sample>,
    /// Pressure maps.
    pub pictures: Vec<Picture>,
}

/// The demonstration has no result.
#[derive(Debug)]
pub enum DemoError {
    /// The run has no figures.
    Metrics(MetricsError),
    /// The script has no touch or no release.
    Script,
    /// The controller stopped with this fault.
    Fault(u8),
    /// A picture could not be drawn.
    Plot(PlotError),
    /// A file could not be written.
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl core::fmt::Display for DemoError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Metrics(why) => why.fmt(f),
            Self::Script => f.write_str("the script has no touch or no release"),
            Self::Fault(number) => write!(f, "the controller stopped with fault {number}"),
            Self::Plot(why) => why.fmt(f),
            Self::Write { path, source } => write!(f, "cannot write {}: {source}", path.display()),
        }
    }
}

impl core::error::Error for DemoError {}

impl From<MetricsError> for DemoError {
    fn from(why: MetricsError) -> Self {
        Self::Metrics(why)
    }
}

impl From<PlotError> for DemoError {
    fn from(why: PlotError) -> Self {
        Self::Plot(why)
    }
}
