//! What a step reports beside the duty, and the same as numbers: what digests of runs are made of.

use crate::calibrate::{self, Standing, scale};
use crate::commission::{Commissioning, Drive};
use crate::contact::{Contact, FitLevel};
use crate::identify::{Identification, Modulus};
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
            Mode::Approach | Mode::Force | Mode::Release | Mode::Identify | Mode::Commission => {
                Bridge::Driven(self.duty)
            }
        }
    }
}

impl Taken {
    /// Four numbers in a word; the last one's upper byte is 0.
    pub(crate) fn words(self) -> [u32; 2] {
        let Self { tare, clear, identify, calibrate, forget, shown, commission } = self;
        [[tare, clear, identify, calibrate], [forget, shown, commission, 0]].map(u32::from_le_bytes)
    }

    /// Reads the two words that a capture has of the numbers; `None` where the last one's upper byte is not 0.
    pub fn from_words(words: [u32; 2]) -> Option<Self> {
        let [[tare, clear, identify, calibrate], [forget, shown, commission, none]] = words.map(u32::to_le_bytes);
        (none == 0).then_some(Self { tare, clear, identify, calibrate, forget, shown, commission })
    }
}

impl Status {
    /// Hands over every field, and the duty that the step returned with it. What a measurement found counts once it is
    /// there.
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
            identification,
            commissioning,
            calibration,
            scale,
            tare,
            taken,
            winding,
            chip,
            drift,
        } = *self;
        let Contact { force, indentation, centre_x, centre_y, radius, peak_pa, confidence, doubt, bad_taxels } =
            contact;
        let calibrate::Standing { state, progress, presses, reached, proposals } = calibration;
        let scale::Standing { refusal, points, factor_ppm, sigma_ppm } = scale;
        let [taken, more_taken] = taken.words();
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
            taken,
            more_taken,
            u32::from_le_bytes([state.number(), state.refusal(), progress, presses]),
            u32::from(reached) | u32::from(proposals) << 16,
            u32::from_le_bytes([refusal.map_or(0, |refusal| refusal as u8), points, 0, 0]),
            factor_ppm,
            sigma_ppm,
            u32::from_le_bytes([
                identification.number(),
                identification.refusal(),
                commissioning.number(),
                commissioning.refusal(),
            ]),
            commissioning.progress().into(),
        ];
        always.iter().for_each(|word| each(*word));
        if identification.number() == 2 {
            let Modulus { modulus, sigma, contact, points } = identification.result();
            for bits in [modulus.to_bits(), sigma.to_bits(), contact.to_bits(), points.into()] {
                each(bits.cast_unsigned());
            }
        }
        if commissioning.number() == 3 {
            let Drive {
                torque_constant_unm_per_a,
                torque_constant_sigma,
                time_constant_us,
                time_constant_sigma,
                inertia_ug_m2,
                inertia_sigma,
                friction_unm: [forward, back],
                friction_sigma: [forward_sigma, back_sigma],
            } = commissioning.drive();
            for word in [torque_constant_unm_per_a, time_constant_us, inertia_ug_m2] {
                each(word);
            }
            let halves = [torque_constant_sigma, time_constant_sigma, inertia_sigma, forward, back];
            for half in halves.into_iter().chain([forward_sigma, back_sigma]) {
                each(half.into());
            }
        }
    }
}
