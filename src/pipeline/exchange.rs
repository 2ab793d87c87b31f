//! What goes into a step beside the frame, and what comes out of it beside the duty.

use crate::contact::Effort;
use crate::identify::Identification;
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
    /// How much work may be put into the contact.
    pub effort: Effort,
    /// A change of this number asks for a tare.
    pub tare_request: u8,
    /// A change of this number clears a fault.
    pub clear_request: u8,
    /// A change of this number asks for a measurement of Young's modulus.
    pub identify_request: u8,
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
    /// Highest pressure on a taxel, Pa.
    pub peak_pa: u32,
    /// How far the picture is a hemisphere on a plane: 0 not at all, 255 fully.
    pub confidence: u8,
    /// How far the force is known only from below: 0 not at all; 255 where much of the contact is hidden and no fit says how much.
    pub doubt: u8,
    /// Taxels left out because they are dead or saturated.
    pub bad_taxels: u8,
}

/// The numbers of the requests last taken up: a command's number that differs still waits, for a frame or for torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// See [`Command::tare_request`].
    pub tare: u8,
    /// See [`Command::clear_request`].
    pub clear: u8,
    /// See [`Command::identify_request`].
    pub identify: u8,
}

/// How the tare that was last asked for stands. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Taring {
    /// None was asked for since reset.
    #[default]
    None = 0,
    /// It is under way.
    Running = 1,
    /// It is done.
    Done = 2,
    /// A fault stood, or ended it: ask again once that is cleared.
    Refused = 3,
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
    /// The effort in use: what was asked for, or what there is time for.
    pub effort: Effort,
    /// What the frame says.
    pub contact: Contact,
    /// Tip travel since torque was enabled.
    pub travel: Millimetres,
    /// Tip speed by the observer.
    pub speed: MillimetresPerSecond,
    /// The duty that was returned.
    pub duty: Duty,
    /// The measurement of Young's modulus.
    pub identification: Identification,
    /// The tare.
    pub tare: Taring,
    /// The requests taken up.
    pub taken: Taken,
}

/// What the bridge is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// Its driver sleeps: it reported a fault.
    Asleep,
    /// Both outputs low: the motor coasts.
    Open,
    /// The motor is shorted: it resists what turns it.
    Brakes,
    /// Slow decay with this duty.
    Driven(Duty),
}

impl Status {
    /// What the bridge is to do.
    ///
    /// A fault brakes: a tip that presses holds the energy of its indentation, and would fly back for many millimetres if the motor
    /// coasted. Shorted, the motor lets go slowly, by itself.
    pub fn bridge(&self) -> Bridge {
        match self.mode {
            Mode::Fault if self.fault == Some(Fault::Bridge) => Bridge::Asleep,
            Mode::Fault => Bridge::Brakes,
            Mode::Off | Mode::Tare => Bridge::Open,
            Mode::Approach | Mode::Force | Mode::Release | Mode::Identify => Bridge::Driven(self.duty),
        }
    }
}
