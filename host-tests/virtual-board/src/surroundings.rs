//! What lies around the board: the plant of `host-tests`, or one finger in the world of a scene.

use crate::bench::STEP_NS;
use crate::inside::ROOM_C;
use crate::scene::finger::Finger;
use sim::mechanics::Bridge;
use sim::plant::Plant;

/// The world behind the board's pins.
#[derive(Debug)]
pub enum Surroundings {
    /// The plant.
    Plant(Box<Plant>),
    /// A scene's.
    Scene(Box<Finger>),
}

impl From<Plant> for Surroundings {
    fn from(world: Plant) -> Self {
        Self::Plant(Box::new(world))
    }
}

impl From<Finger> for Surroundings {
    fn from(finger: Finger) -> Self {
        Self::Scene(Box::new(finger))
    }
}

impl Surroundings {
    /// Goes from one instant of the board to another with the bridge held.
    pub fn advance(&mut self, from_ns: u64, to_ns: u64, bridge: Bridge) {
        let dt_s = (to_ns - from_ns) as f64 * 1e-9;
        match self {
            Self::Plant(world) => world.advance(dt_s, bridge),
            Self::Scene(finger) => finger.advance(to_ns),
        }
    }

    /// Sets the bridge state from now on. The plant gets it with each step instead.
    pub fn hold(&mut self, bridge: Bridge) {
        if let Self::Scene(finger) = self {
            finger.hold(bridge);
        }
    }

    /// Time between two steps of the world, ns.
    pub fn grid_ns(&self) -> u64 {
        match self {
            Self::Plant(_) => STEP_NS,
            Self::Scene(finger) => finger.grid_ns(),
        }
    }

    /// Returns true if the world is also stepped at the end of each frame: its grid is too coarse for the control step.
    pub fn follows_frames(&self) -> bool {
        matches!(self, Self::Scene(_))
    }

    /// The supply at the bridge.
    pub fn supply_v(&self) -> f64 {
        match self {
            Self::Plant(world) => world.supply_v(),
            Self::Scene(finger) => finger.supply_v(),
        }
    }

    /// The microcontroller's temperature.
    pub fn chip_c(&self, at_ns: u64) -> f64 {
        match self {
            Self::Plant(_) => ROOM_C,
            Self::Scene(finger) => finger.chip_c(at_ns),
        }
    }

    /// Unwrapped counts of the timer in encoder mode at a board time.
    pub fn encoder_counts(&self, at_ns: u64) -> i32 {
        match self {
            Self::Plant(world) => world.encoder_counts(),
            Self::Scene(finger) => finger.encoder_counts(at_ns),
        }
    }

    /// The converters' reference.
    pub fn reference_v(&self) -> f64 {
        match self {
            Self::Plant(world) => world.setup().array.reference_v,
            Self::Scene(finger) => finger.reference_v(),
        }
    }
}
