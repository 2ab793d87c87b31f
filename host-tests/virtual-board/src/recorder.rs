//! What the world did, sampled while it runs: the truth that the image never sees.

use crate::surroundings::Surroundings;
use host_tests::metrics::Sample;
use host_tests::plant::Bridge;

/// Samples the plant at an even pace; a scene's world is not sampled here.
#[derive(Clone, Debug)]
pub struct Recorder {
    every_ns: u64,
    /// What was sampled; goal, sensed force and mode are the client's to fill in.
    pub samples: Vec<Sample>,
}

impl Recorder {
    /// One that samples every so often, at multiples of that time.
    pub fn every(every_ns: u64) -> Self {
        Self { every_ns: every_ns.max(1), samples: Vec::new() }
    }

    /// Takes a sample where one is due.
    pub fn look(&mut self, now_ns: u64, world: &Surroundings, bridge: Bridge) {
        let Surroundings::Plant(world) = world else { return };
        if !now_ns.is_multiple_of(self.every_ns) {
            return;
        }
        let duty = match bridge {
            Bridge::Coast => 0.0,
            Bridge::Driven { duty } => duty,
        };
        self.samples.push(Sample {
            time_s: now_ns as f64 * 1e-9,
            true_force_n: world.force_n(),
            travel_mm: world.travel_mm(),
            indentation_mm: world.indentation_mm(),
            duty,
            ..Sample::default()
        });
    }
}
