//! What a step reports beside the duty.

use crate::calibrate::{Standing, scale};
use crate::commission::Commissioning;
use crate::contact::{Contact, FitLevel};
use crate::identify::Identification;
use crate::state::{Fault, Limits, Mode};
use crate::units::{Celsius, Duty, Millimetres, MillimetresPerSecond, Newtons};

/// The numbers of the requests last taken up: a command's number that differs still waits, for a frame or for torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// See [`crate::command::Command::tare_request`].
    pub tare: u8,
    /// See [`crate::command::Command::clear_request`].
    pub clear: u8,
    /// See [`crate::command::Command::identify_request`].
    pub identify: u8,
    /// See [`crate::command::Command::calibrate_request`].
    pub calibrate: u8,
    /// See [`crate::command::Command::forget_request`].
    pub forget: u8,
    /// See [`crate::command::Command::shown_request`].
    pub shown: u8,
    /// See [`crate::command::Command::commission_request`].
    pub commission: u8,
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
    /// The fit level in use: what was asked for, or what there is time for.
    pub fit_level: FitLevel,
    /// What the frame says.
    pub contact: Contact,
    /// What of the contact's force is taken for the array's creep: the force that is held is less by this.
    pub creep: Newtons,
    /// The microcontroller's temperature, where it was measured.
    pub chip: Option<Celsius>,
    /// What the goal's force reads more than it is, for the array's temperature.
    pub drift: Newtons,
    /// The motor's winding, by the current of the motor's model.
    pub winding: Celsius,
    /// Tip travel since torque was enabled.
    pub travel: Millimetres,
    /// Tip speed by the observer.
    pub speed: MillimetresPerSecond,
    /// The duty that was returned.
    pub duty: Duty,
    /// The measurement of Young's modulus.
    pub identification: Identification,
    /// The commissioning of the drive.
    pub commissioning: Commissioning,
    /// The calibration of the taxels.
    pub calibration: Standing,
    /// The absolute scale by what a scale shows.
    pub scale: scale::Standing,
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
    /// A fault brakes: a tip that presses holds the energy of its indentation, and would fly back for many millimetres
    /// if the motor coasted. Shorted, the motor lets go slowly, by itself.
    pub fn bridge(&self) -> Bridge {
        match self.mode {
            Mode::Fault if self.fault == Some(Fault::Bridge) => Bridge::Asleep,
            Mode::Fault => Bridge::Brakes,
            Mode::Off | Mode::Tare => Bridge::Open,
            Mode::Approach | Mode::Force | Mode::Release | Mode::Identify | Mode::Commission => {
                Bridge::Driven(self.duty)
            }
        }
    }
}
