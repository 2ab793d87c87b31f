//! What acts on the loop between two steps: other parameters or gains, a look at half a frame, a stop, a beginning anew.

use super::{Budget, Fit, Goal, Guard, Monitor, Pipeline, Press, Run, Scale, SpeedLoop, Status, Taken, Taring};
use crate::commission;
use crate::config::Shaped;
use crate::control::winding::Winding;
use crate::frame::Frame;
use crate::identify::Refusal;
use crate::pressure::Calibration;
use crate::state::{Fault, Mode};
use crate::units::Duty;

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// Replaces the configuration; the mode goes to off, where it is not fault. The tare stays; one under way begins
    /// anew, as does the contact's fit.
    pub fn configure(&mut self, config: &Shaped<ROWS, COLUMNS>) {
        self.config = config.clone();
        self.array.forget_line();
        self.fit.lose();
        self.interrupt_commission();
        // What was measured belonged to the parameters before.
        if !matches!(self.status.commissioning, commission::Commissioning::Refused(_)) {
            self.commission = Run::new();
            self.status.commissioning = self.commission.outcome();
        }
        self.forget();
        self.leave();
    }

    /// Replaces the taxels' gains and mask; the mode goes to off, where it is not fault, and a new tare is needed; one
    /// under way begins anew.
    pub fn calibrate(&mut self, calibration: &Calibration<ROWS, COLUMNS>) {
        self.array.calibrate(calibration);
        self.fit.lose();
        self.forget();
        self.tared = false;
        self.leave();
    }

    /// Stops for a reason that the firmware saw (frame guard, broken parameters, crash); latched like any fault.
    pub fn stop(&mut self, fault: Fault) {
        self.status.mode = Mode::Fault;
        self.status.fault.get_or_insert(fault);
        if self.press.running() {
            self.press.refuse(Refusal::Interrupted);
            self.status.identification = self.press.outcome();
        }
        self.interrupt_commission();
        self.calibrator.interrupt();
        self.status.calibration = self.calibrator.standing();
        if self.status.tare == Taring::Running {
            self.status.tare = Taring::Refused;
        }
        self.status.duty = self.motion.coast();
    }

    /// A look at a frame that is still being scanned, filled up from the frame before: shorts the motor where its array
    /// seems broken, and tells whether. A taxel that fails just after it was read is seen a frame later; without this
    /// look the motor would be driven until that frame's end. Whether it is a fault is for the step to say.
    pub fn check_part(&mut self, frame: &Frame<ROWS, COLUMNS>) -> bool {
        let broken = self.watched()
            && self.array.bad_taxels(frame, &self.config) > self.config.params.bad_taxels_max.max(0) as u32;
        if broken {
            self.motion.drive.cut();
            self.status.duty = Duty::ZERO;
        }
        broken
    }

    /// Makes all anew but the configuration and the taxels' gains: mode off, not tared, nothing measured. Requests with
    /// these numbers count as taken up, and so many frames as missed before. The motor stays as warm as it is told.
    pub fn renew(&mut self, taken: Taken, missed_frames: u32, winding: Winding) {
        self.array.renew();
        self.budget = Budget::new();
        self.fit = Fit::default();
        self.motion = SpeedLoop::new();
        self.motion.winding = winding;
        self.monitor = Monitor::default();
        self.guard = Guard::default();
        self.goal = Goal::default();
        self.press = Press::new();
        self.commission = Run::new();
        self.scale = Scale::new();
        self.calibrator.renew();
        self.status = Status { taken, missed_frames, ..Status::default() };
        self.tared = false;
    }

    /// How warm the motor's winding is, and all that this follows from.
    pub fn winding(&self) -> &Winding {
        &self.motion.winding
    }
}
