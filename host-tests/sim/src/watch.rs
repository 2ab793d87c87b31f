//! What a run shows of itself, a control step at a time.

use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Frame, ROWS};
use serde::{Deserialize, Serialize};

/// What a finger's controller is set to when a run begins. With every [`Step`] after it, a replay needs nothing else.
#[derive(Clone, Debug)]
pub struct Controller {
    /// Its parameters.
    pub params: Params,
    /// Its taxels' gains and mask, where it is given any.
    pub calibration: Option<Gains>,
}

/// What a calibration is made of; see `fingertip::shipped::Calibration::new`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gains {
    /// Gain of each taxel, Q14.
    pub gains_q14: [[u16; COLUMNS]; ROWS],
    /// A bit for each column that is left out, for each row.
    pub masks: [u32; ROWS],
}

/// One control step of one finger: what went in, what came out, and what was true.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Which finger, from 0.
    pub finger: usize,
    /// Virtual time at the step, from the scene's start; below 0 while the finger is tared.
    pub time_s: f64,
    /// What the core was given, whole: a recording of these replays the run to the bit.
    pub frame: &'a Frame,
    /// See [`Step::frame`].
    pub sense: &'a Sense,
    /// See [`Step::frame`].
    pub command: &'a Command,
    /// What the core answered; the duty is in it.
    pub status: &'a Status,
    /// What only the simulated world knows.
    pub truth: &'a Truth,
}

/// The world's state at a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Normal force between tip and object.
    pub force_n: f64,
    /// Indentation of the tip.
    pub indentation_mm: f64,
    /// Centre of the contact from the array's middle, along columns and rows.
    pub centre_mm: [f64; 2],
    /// Way of the tip from its start.
    pub travel_mm: f64,
    /// Speed of the tip.
    pub speed_mm_per_s: f64,
    /// Winding current.
    pub current_a: f64,
    /// Supply at the bridge.
    pub supply_v: f64,
    /// Share of the supply at the motor, -1 to 1; positive presses.
    pub duty: f64,
    /// Temperature of the winding, where a scene heats it; 25 else.
    pub winding_c: f64,
    /// Tangential force on the object, upwards.
    pub tangential_n: f64,
    /// Way that the contact has slipped since the start.
    pub slip_mm: f64,
    /// Place of the object along the fingers' motion and upwards.
    pub object_mm: [f64; 2],
    /// Distance to which an event has taken the object away from the fingers.
    pub object_away_mm: f64,
    /// True while an event acts on the finger, its object or its controller.
    pub disturbed: bool,
    /// True while a defect of the events acts and for a second after it: it may be the cause of a fault.
    pub defective: bool,
    /// Force at the tip that dry friction and the gear hold without the motor; infinite where the gear locks itself.
    pub friction_n: f64,
    /// Whether the object broke.
    pub broken: bool,
    /// Mean true pressure on each taxel, where somebody asked for it ([`Watch::wants_pressures`]); 0 else.
    pub pressures_kpa: [[f64; COLUMNS]; ROWS],
}

/// Somebody who watches a run. Nothing that a watcher does can change the run.
pub trait Watch {
    /// The run begins with these controllers, one for each finger.
    fn begin(&mut self, _controllers: &[Controller]) {}

    /// Whether this step's true pressures are wanted: they cost.
    fn wants_pressures(&mut self, _finger: usize, _time_s: f64) -> bool {
        false
    }

    /// Whether every frame is wanted. The emulated board shows those that an answer on the bus speaks of; the others have the status of
    /// the last answer.
    fn wants_every_frame(&self) -> bool {
        false
    }

    /// A control step was taken.
    fn step(&mut self, step: &Step);
}

/// What an effect cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Cost {
    /// The effect's name.
    pub effect: &'static str,
    /// How often it was called.
    pub evaluations: u64,
    /// Its wall time, from a sample of its calls.
    pub seconds: f64,
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// Virtual time.
    pub virtual_s: f64,
    /// Wall time before the scene begins: to build the world, to power the boards up and to tare them.
    pub set_up_s: f64,
    /// Wall time of the scene.
    pub wall_s: f64,
    /// What each named effect cost, in the scene's order.
    pub ledger: Vec<Cost>,
    /// XXH3 of 128 bits over every frame, sense, command, duty and status of the run, in order.
    pub digest: String,
}
