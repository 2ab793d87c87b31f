//! Requests: taken up once, and never lost without a word.
//!
//! | asked for | taken up | otherwise |
//! | --- | --- | --- |
//! | tare | in every mode but fault, also in the frame that clears one | refused: [`Taring::Refused`] |
//! | clear | in fault, with torque off | the fault stands, or there is none |
//! | commission | in off, with torque off and the array tared; a stop in commission | refused: [`commission::Refusal`] |
//! | identify, calibrate | in approach, force and release; with torque on it waits for these while torque is taken up, a tare is under way or another measurement ends | refused: `NotReady` |

use super::{Command, Pipeline, Taring, Unfit};
use crate::commission::{self, Task};
use crate::identify::Refusal;
use crate::state::Mode;

/// Requests that a command brings.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub tare: bool,
    pub clear: bool,
    pub identify: bool,
    pub commission: Option<Task>,
    pub calibrate: bool,
}

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// What is newly asked for. A tare and a clear count in the frame in which they come, whatever else that brings; a
    /// measurement of the modulus counts until [`Pipeline::note_requests`] has an answer to it.
    pub(super) fn take_requests(&mut self, command: &Command) -> Asked {
        let taken = &mut self.status.taken;
        let asked = Asked {
            tare: command.tare_request != taken.tare,
            clear: command.clear_request != taken.clear,
            identify: command.identify_request != taken.identify,
            calibrate: command.calibrate_request != taken.calibrate,
            commission: (command.commission_request != taken.commission).then(|| Task::of(command.commission_request)),
        };
        (taken.tare, taken.clear) = (command.tare_request, command.clear_request);
        taken.commission = command.commission_request;
        let forgets = command.forget_request != taken.forget;
        taken.forget = command.forget_request;
        // So it stays where nothing comes of it.
        if asked.commission.is_some_and(|task| task != Task::Stop) && !self.commission.running() {
            self.commission.refuse(commission::Refusal::NotReady);
        }
        if forgets {
            self.forget();
        }
        asked
    }

    /// Forgets what presses and a scale told: parameters or gains are others now, or the host wants so.
    pub(super) fn forget(&mut self) {
        self.calibrator.forget();
        self.scale.forget();
        (self.status.calibration, self.status.scale) = (self.calibrator.standing(), self.scale.standing());
    }

    /// Answers what was asked for in a frame that a fault ended.
    pub(super) fn refuse(&mut self, asked: Asked, command: &Command) {
        if asked.tare {
            self.status.tare = Taring::Refused;
        }
        if asked.identify {
            self.status.taken.identify = command.identify_request;
            self.press.refuse(Refusal::NotReady);
            self.status.identification = self.press.outcome();
        }
        self.status.commissioning = self.commission.outcome();
        // A press before that is being worked out has its answer first.
        if asked.calibrate && !self.calibrator.busy() {
            self.status.taken.calibrate = command.calibrate_request;
            self.calibrator.refuse(Unfit::NotReady);
            self.status.calibration = self.calibrator.standing();
        }
    }

    /// Answers what was asked for, by what became of the mode.
    pub(super) fn note_requests(&mut self, asked: Asked, before: Mode, mode: Mode, command: &Command) {
        if mode == Mode::Fault {
            if self.status.tare == Taring::Running {
                self.status.tare = Taring::Refused;
            }
            return self.refuse(asked, command);
        }
        if mode == Mode::Tare {
            self.status.tare = Taring::Running;
        } else if before == Mode::Tare {
            self.status.tare = Taring::Done;
        }
        let about_to_drive =
            mode == Mode::Tare || self.tared && matches!(before, Mode::Off | Mode::Tare | Mode::Identify);
        if asked.identify && (self.press.running() || !command.torque || !about_to_drive) {
            self.status.taken.identify = command.identify_request;
            if !self.press.running() {
                self.press.refuse(Refusal::NotReady);
            }
        }
        // The one waits for the other, and for what a press before left to be worked out.
        let waits = about_to_drive || self.tared && (mode == Mode::Identify || self.calibrator.busy());
        let works = self.calibrator.busy() && !self.calibrator.running();
        if asked.calibrate && (self.calibrator.running() || !works && (!command.torque || !waits)) {
            self.status.taken.calibrate = command.calibrate_request;
            if !self.calibrator.running() {
                self.calibrator.refuse(Unfit::NotReady);
            }
        }
    }

    /// Leaves what was going on for what a new configuration or calibration asks: off, where there is no fault. A tare
    /// begins anew.
    pub(super) fn leave(&mut self) {
        match self.status.mode {
            Mode::Fault => {}
            Mode::Tare => self.array.start_tare(),
            _ => self.status.mode = Mode::Off,
        }
    }
}
