//! A scene, read and checked.

pub mod controller;
pub mod error;
pub mod library;
pub(crate) mod reader;
pub mod tables;
pub mod text;

pub use error::{SceneError, SceneErrors};
pub use reader::read;

use crate::events::Event;
use crate::key::Values;
use crate::registry::Named;

/// All that a run needs.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The file's name without its ending.
    pub name: String,
    /// The file, whole.
    pub text: String,
    /// Values that the command line replaced, as `TABLE.KEY=VALUE`. `text` has them too.
    pub set: Vec<String>,
    /// What it shows, in a line.
    pub about: String,
    /// Where all randomness comes from.
    pub seed: u64,
    /// Virtual time from the moment at which the finger is tared and its torque enabled.
    pub duration_s: f64,
    /// Those of [`tables::TABLES`], all of them.
    pub tables: Vec<(&'static str, Values)>,
    /// What the host asks for, in order of time.
    pub script: Vec<Goal>,
    /// What happens to the finger, to its object and to its controller, in order of time.
    pub events: Vec<Event>,
    /// The effects that it names, in the order of the registry.
    pub effects: Vec<Named>,
    /// What must hold.
    pub bounds: Vec<Bound>,
}

impl Scene {
    /// The values of a table.
    ///
    /// # Panics
    /// Where no such table is described.
    pub fn table(&self, name: &str) -> &Values {
        let found = self.tables.iter().find(|(known, _)| *known == name);
        &found.unwrap_or_else(|| panic!("no table [{name}] is described")).1
    }

    /// The same scene for a finger whose host is somebody else: nothing happens to it by time.
    pub fn without_events(&self) -> Self {
        Self { events: Vec::new(), ..self.clone() }
    }
}

/// A goal that the host sends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// When, from the start.
    pub at_s: f64,
    /// The force asked for from then on.
    pub goal_n: f64,
}

/// What a metric must hold. One side may be open.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The metric's name, with its unit: `peak_force_n`.
    pub metric: String,
    /// The least.
    pub min: Option<f64>,
    /// The largest.
    pub max: Option<f64>,
    /// How much larger for each N of the goal, of a metric that has a value for each goal.
    pub max_per_goal_n: Option<f64>,
}
