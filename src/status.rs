//! Report of a step beside the duty. Its digest fields make the digests of runs.

use crate::contact::{Contact, FitLevel};
use crate::measure::MeasureStatus;
use crate::state::{Fault, Limits, Mode};
use crate::units::{Celsius, Duty, Millimetres, MillimetresPerSecond, Newtons};

/// Numbers of the requests that the loop acknowledged last. A number of the command that differs still waits, for a
/// frame or for torque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AcknowledgedRequests {
    /// See [`crate::command::Command::tare_request`].
    pub tare: u8,
    /// See [`crate::command::Command::clear_request`].
    pub clear: u8,
    /// See [`crate::command::Command::measure_request`].
    pub measure: u8,
}

/// State of the tare that was requested last. The numbers are stable.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Taring {
    /// No tare was requested since reset.
    #[default]
    None = 0,
    /// The tare is under way.
    Running = 1,
    /// The tare is done.
    Done = 2,
    /// The tare was refused, and the zero before remains; or a fault ended it, and there is none.
    Refused = 3,
}

/// Report of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// Number of the step's frame.
    pub sequence: u32,
    /// Number of frames missed since the pipeline was made; wraps.
    pub missed_frames: u32,
    /// Activity of the controller.
    pub mode: Mode,
    /// Reason why the motor was stopped, if it was.
    pub fault: Option<Fault>,
    /// Limits that reduce the duty or refuse a request.
    pub limits: Limits,
    /// Fit level in use: the requested one, or the largest that the time allows.
    pub fit_level: FitLevel,
    /// Contact of the frame.
    pub contact: Contact,
    /// Part of the contact's force that is taken for creep of the array: the held force is less by this.
    pub creep: Newtons,
    /// Temperature of the microcontroller, if it was measured.
    pub chip: Option<Celsius>,
    /// Amount by which a force of the goal's size reads too high because of the array's temperature.
    pub drift: Newtons,
    /// Temperature of the motor's winding, estimated from the current of the motor's model.
    pub winding: Celsius,
    /// Tip travel from where the motor was first driven.
    pub travel: Millimetres,
    /// Tip speed by the observer.
    pub speed: MillimetresPerSecond,
    /// Duty that the step returned.
    pub duty: Duty,
    /// True while a motor that is not driven is shorted: in a fault, and in off and tare while the tip still moves.
    pub braking: bool,
    /// Progress of the motion that measures.
    pub measure: MeasureStatus,
    /// State of the tare.
    pub tare: Taring,
    /// Acknowledged requests.
    pub taken: AcknowledgedRequests,
}

/// A state of the H-bridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// The driver sleeps after it has reported a fault.
    Asleep,
    /// Both outputs in high impedance: the motor coasts.
    Open,
    /// The motor is shorted, which brakes it.
    Brakes,
    /// Slow decay with this duty.
    Driven(Duty),
}

impl Status {
    /// The state of the H-bridge that the board sets after this frame.
    ///
    /// A fault brakes: a tip that presses holds the energy of its indentation, and would fly back for many
    /// millimetres if the motor coasted. A shorted motor is pushed back slowly. A finger whose torque is turned off
    /// brakes as well, until the tip is at rest.
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

impl AcknowledgedRequests {
    /// Packs the numbers into a word, whose upper byte is 0.
    pub(crate) fn word(self) -> u32 {
        let Self { tare, clear, measure } = self;
        u32::from_le_bytes([tare, clear, measure, 0])
    }

    /// Reads the word that a capture has of the numbers; `None` if its upper byte is not 0.
    pub fn from_word(word: u32) -> Option<Self> {
        let [tare, clear, measure, none] = word.to_le_bytes();
        (none == 0).then_some(Self { tare, clear, measure })
    }
}

impl Status {
    /// Passes every field on as digest fields, with the duty that the step returned.
    pub fn words(&self, duty: Duty, mut each: impl FnMut(u32)) {
        // Destructured field by field, so that a field cannot be forgotten.
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
        let MeasureStatus { state, task, ended, value, progress } = measure;
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
