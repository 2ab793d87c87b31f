//! What the tests of the world share.

use fingertip::state::Mode;
use sim::scene::{Scene, read};
use sim::watch::{Step, Truth, Watch};

/// A scene from its text, without the line that says what it shows.
pub fn scene(text: &str) -> Scene {
    read("test.toml", &format!("about = \"a test\"\n{text}"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Keeps the last step and the highest force.
#[derive(Debug, Default)]
pub struct Last {
    pub steps: u64,
    pub truth: Truth,
    pub mode: Option<Mode>,
    pub peak_n: f64,
}

impl Watch for Last {
    fn step(&mut self, step: &Step) {
        self.steps += 1;
        self.truth = *step.truth;
        self.mode = Some(step.status.mode);
        self.peak_n = self.peak_n.max(step.truth.force_n);
    }
}
