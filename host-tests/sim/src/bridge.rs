//! Bridge of the motor, as the world sees it.

use crate::metrics;
use fingertip::pipeline::{self, Status};
use serde::{Deserialize, Serialize};

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
    /// State of the bridge that a control step requests.
    pub fn of(status: &Status) -> Self {
        match status.bridge() {
            pipeline::Bridge::Asleep | pipeline::Bridge::Open => Self::Coast,
            pipeline::Bridge::Brakes => Self::Driven { duty: 0.0 },
            pipeline::Bridge::Driven(duty) => Self::Driven { duty: metrics::duty(duty) },
        }
    }
}
