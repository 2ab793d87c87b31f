//! One frame's way from codes to duty.

use crate::frame::{Frame, Sense};
use crate::safety::{Fault, Limits, Mode};
use crate::units::{Duty, Millimetres, MillimetresPerSecond, Newtons};

/// What the host asks of the loop; a snapshot, replaced as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Command {
    /// Whether the bridge may be driven.
    pub torque: bool,
    /// The force to hold, 0 to let go.
    pub goal: Newtons,
    /// Bus watchdog in ms; 0 is off.
    pub bus_watchdog_ms: u16,
    /// A change of this number asks for a tare.
    pub tare_request: u8,
    /// A change of this number clears a fault.
    pub clear_request: u8,
}

/// What a frame says of the contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Total normal force.
    pub force: Newtons,
    /// Indentation of the tip, from the force by the model.
    pub indentation: Millimetres,
    /// Centre of pressure along the columns, from the array's middle.
    pub centre_x: Millimetres,
    /// Centre of pressure along the rows, from the array's middle.
    pub centre_y: Millimetres,
    /// Contact radius, by the model.
    pub radius: Millimetres,
    /// Highest taxel pressure, Pa.
    pub peak_pa: u32,
    /// How far the picture is a hemisphere on a plane: 0 not at all, 255 fully.
    pub confidence: u8,
    /// Taxels left out because they are dead or saturated.
    pub bad_taxels: u8,
}

/// What a step reports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// The frame it was made from.
    pub sequence: u32,
    /// Frames missed since the pipeline was made; wraps.
    pub missed_frames: u32,
    /// What the controller is doing.
    pub mode: Mode,
    /// Why it stopped, where it did.
    pub fault: Option<Fault>,
    /// What holds it back.
    pub limits: Limits,
    /// What the frame says.
    pub contact: Contact,
    /// Tip travel since torque was enabled.
    pub travel: Millimetres,
    /// Tip speed by the observer.
    pub speed: MillimetresPerSecond,
    /// The duty that was returned.
    pub duty: Duty,
}

/// The loop's state between frames.
#[derive(Clone, Debug)]
pub struct Pipeline {
    status: Status,
}

impl Pipeline {
    /// A pipeline in the mode off.
    pub fn new(_config: &crate::config::Config) -> Self {
        Self { status: Status::default() }
    }

    /// Replaces the configuration; the mode goes to off.
    pub fn configure(&mut self, _config: &crate::config::Config) {}

    /// One frame's way from codes to duty. Infallible: any frame, any sense, any command.
    pub fn step(&mut self, frame: &Frame, _sense: &Sense, _command: &Command) -> (Duty, Status) {
        self.status.sequence = frame.sequence;
        (Duty::ZERO, self.status)
    }

    /// Stops for a reason that the firmware saw (frame guard, broken parameters, crash); latched like any fault.
    pub fn stop(&mut self, fault: Fault) -> Status {
        self.status.mode = Mode::Fault;
        self.status.fault.get_or_insert(fault);
        self.status
    }
}
