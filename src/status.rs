//! What a step reports beside the duty, and the same as numbers: what digests of runs are made of.

use crate::contact::{Contact, FitLevel};
use crate::measure::Standing;
use crate::state::{Fault, Limits, Mode};
use crate::units::{Celsius, Duty, Millimetres, MillimetresPerSecond, Newtons};

/// The numbers of the requests last taken up: a command's number that differs still waits, for a frame or for torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// See [`crate::command::Command::tare_request`].
    pub tare: u8,
    /// See [`crate::command::Command::clear_request`].
    pub clear: u8,
    /// See [`crate::command::Command::measure_request`].
    pub measure: u8,
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
    /// A fault was there, or ended it; or something was pressed, and the zero before remains.
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
    /// Tip travel from where torque was first enabled.
    pub travel: Millimetres,
    /// Tip speed by the observer.
    pub speed: MillimetresPerSecond,
    /// The duty that was returned.
    pub duty: Duty,
    /// In off and tare: the tip still moves, so the motor is shorted.
    pub braking: bool,
    /// The motion that measures.
    pub measure: Standing,
    /// The tare.
    pub tare: Taring,
    /// The requests taken up.
    pub taken: Taken,
}

/// A state of the H-bridge.
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
    /// The state of the H-bridge that the board sets after this frame.
    ///
    /// A fault brakes: a tip that presses holds the energy of its indentation, and would fly back for many millimetres
    /// if the motor coasted. Shorted, the motor is pushed back slowly. So does a finger whose torque is turned off, until
    /// the tip is at rest.
    pub fn bridge(&self) -> Bridge {
        match self.mode {
            Mode::Fault if self.fault == Some(Fault::Bridge) => Bridge::Asleep,
            Mode::Fault => Bridge::Brakes,
            Mode::Off | Mode::Tare if self.braking => Bridge::Brakes,
            Mode::Off | Mode::Tare => Bridge::Open,
            Mode::Approach | Mode::Force | Mode::Release | Mode::Press | Mode::Strokes => Bridge::Driven(self.duty),
        }
    }
}

impl Taken {
    /// The numbers in a word, whose upper byte is 0.
    pub(crate) fn word(self) -> u32 {
        let Self { tare, clear, measure } = self;
        u32::from_le_bytes([tare, clear, measure, 0])
    }

    /// Reads the word that a capture has of the numbers; `None` where its upper byte is not 0.
    pub fn from_word(word: u32) -> Option<Self> {
        let [tare, clear, measure, none] = word.to_le_bytes();
        (none == 0).then_some(Self { tare, clear, measure })
    }
}

impl Status {
    /// Hands over every field, and the duty that the step returned with it.
    pub fn words(&self, duty: Duty, mut each: impl FnMut(u32)) {
        // Taken apart field by field, so that a field cannot be forgotten.
        let Self {
            sequence,
            missed_frames,
            mode,
            fault,
            limits,
            fit_level,
            contact,
            creep,
            travel,
            speed,
            duty: applied,
            braking,
            measure,
            tare,
            taken,
            winding,
            chip,
            drift,
        } = *self;
        let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } =
            contact;
        let Standing { state, task, ended, value, progress } = measure;
        let always = [
            sequence,
            missed_frames,
            u32::from_le_bytes([mode as u8, fault.map_or(0, |fault| fault as u8), fit_level as u8, tare as u8]),
            u32::from(limits.0) | u32::from(bad_taxels) << 16,
            u32::from_le_bytes([confidence, doubt, braking.into(), 0]),
            peak_pa,
            force.to_bits().cast_unsigned(),
            creep.to_bits().cast_unsigned(),
            drift.to_bits().cast_unsigned(),
            speed.to_bits().cast_unsigned(),
            winding.to_bits().cast_unsigned(),
            chip.unwrap_or_default().to_bits().cast_unsigned(),
            indentation.to_bits().cast_unsigned(),
            centre_x.to_bits().cast_unsigned(),
            centre_y.to_bits().cast_unsigned(),
            radius.to_bits().cast_unsigned(),
            travel.to_bits().cast_unsigned(),
            u32::from(duty.0.cast_unsigned()) | u32::from(applied.0.cast_unsigned()) << 16,
            taken.word(),
            u32::from_le_bytes([state as u8, task as u8, ended as u8, progress]),
            value.cast_unsigned(),
        ];
        always.iter().for_each(|word| each(*word));
    }
}
