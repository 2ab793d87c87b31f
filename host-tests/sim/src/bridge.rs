//! The motor's bridge, as the world sees it.

use fingertip::pipeline::{self, Status};
use fingertip::units::Duty;
use serde::{Deserialize, Serialize};

/// What the bridge does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Bridge {
    /// Both half bridges open.
    #[default]
    Coast,
    /// PWM in slow decay.
    Driven {
        /// Share of the supply, -1 to 1; positive presses. 0 brakes.
        duty: f64,
    },
}

impl Bridge {
    /// What a step means at the bridge.
    pub fn of(status: &Status) -> Self {
        match status.bridge() {
            pipeline::Bridge::Asleep | pipeline::Bridge::Open => Self::Coast,
            pipeline::Bridge::Brakes => Self::Driven { duty: 0.0 },
            pipeline::Bridge::Driven(duty) => Self::Driven { duty: f64::from(duty.0) / f64::from(Duty::FULL) },
        }
    }
}
