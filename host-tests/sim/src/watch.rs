//! Values that a run shows to its watchers, one control step at a time.

use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, ROWS};
use serde::{Deserialize, Serialize};

/// Settings of a controller when a run begins. With all [`Step`]s they are sufficient for a replay.
#[derive(Clone, Debug)]
pub struct Controller {
    pub params: Params,
    /// Gains and mask of the taxels, if any.
    pub calibration: Option<Gains>,
}

/// Contents of a calibration; see `fingertip::shipped::Calibration::new`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gains {
    /// Gain of each taxel, Q14.
    pub gains_q14: [[u16; COLUMNS]; ROWS],
    /// Masked columns of each row, a bit each.
    pub masks: [u32; ROWS],
}

/// Control step of one finger: inputs, outputs and truth.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Number of the finger, from 0.
    pub finger: usize,
    /// Virtual time from the start of the scene; negative while the finger is tared.
    pub time_s: f64,
    /// Complete input of the core with `sense` and `command`: a recording of them replays the run to the bit.
    pub frame: &'a Frame,
    pub sense: &'a Sense,
    pub command: &'a Command,
    /// Output of the core, with the duty.
    pub status: &'a Status,
    /// True state of the simulated world.
    pub truth: &'a Truth,
}

/// True state of the world at a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Normal force between tip and object.
    pub force_n: f64,
    pub indentation_mm: f64,
    /// Centre of the contact from the array's middle, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Travel of the tip from its start.
    pub travel_mm: f64,
    pub speed_mm_per_s: f64,
    pub current_a: f64,
    pub supply_v: f64,
    /// Share of the supply at the motor, -1 to 1; positive presses.
    pub duty: f64,
    /// Temperature of the winding; 25 unless a scene heats it.
    pub winding_c: f64,
    /// Tangential force on the object, upwards.
    pub tangential_n: f64,
    /// Distance that the contact has slipped since the start.
    pub slip_mm: f64,
    /// Place of the object along the fingers' motion and upwards.
    pub object_mm: [f64; 2],
    /// Distance to which an event has removed the object from the fingers.
    pub object_away_mm: f64,
    /// True while an event acts on the finger, its object or its controller.
    pub disturbed: bool,
    /// True while a defect acts and for a second after it: it may cause a fault.
    pub defective: bool,
    /// Force at the tip that dry friction and the gear hold without the motor; infinite for a self-locking gear.
    pub friction_n: f64,
    pub broken: bool,
    /// Mean true pressure on each taxel if a watcher requests it ([`Watch::wants_pressures`]), else 0.
    pub pressures_kpa: [[f64; COLUMNS]; ROWS],
}

/// Watcher of a run. It cannot change the run.
pub trait Watch {
    /// Starts the run with these controllers, one for each finger.
    fn begin(&mut self, _controllers: &[Controller]) {}

    /// Returns true if the true pressures of this step are requested. They cost time.
    fn wants_pressures(&mut self, _finger: usize, _time_s: f64) -> bool {
        false
    }

    /// Returns true if every frame is requested. Otherwise the emulated board shows the frames that an answer on the
    /// bus covers, and the others have the status of the last answer.
    fn wants_every_frame(&self) -> bool {
        false
    }

    /// Receives a control step.
    fn step(&mut self, step: &Step);
}

#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    pub effect: &'static str,
    pub evaluations: u64,
    /// Wall time, estimated from a sample of the calls.
    pub seconds: f64,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    pub virtual_s: f64,
    /// Wall time before the start of the scene: to build the world, to power the boards up and to tare them.
    pub set_up_s: f64,
    pub wall_s: f64,
    /// Cost of each effect, in the order of the scene.
    pub ledger: Vec<Cost>,
    /// Wall time of each stage of a frame without its effects; empty if the board does not measure it.
    pub stages: Vec<Cost>,
    /// XXH3 of 128 bits over every frame, sense, command, duty and status of the run, in order.
    pub digest: String,
}
