//! Requests: each is accepted once or refused with its reason, here and nowhere else.
//!
//! | request | accepted | otherwise |
//! | --- | --- | --- |
//! | clear | in fault, with torque off | the fault remains, or there is none |
//! | tare | in every activity but fault, also in the frame that clears one; not while something is pressed, unless that was [forced](Command::tare_forced): the zero before remains | refused: [`Taring::Refused`] |
//! | torque on | in off, once the tip is slow; not before a tare, nor after one while something touched the tip, unless that was [forced](Command::tare_forced) | the finger stays off; limits 6 and 10 give the reason |
//! | torque off | in every activity | |
//! | commission | in off, with torque off and the array tared; a stop in commission | refused: [`commission::Refusal`] |
//! | identify, calibrate | in a grip; with torque on it waits while torque is taken up, a tare is under way or another measurement ends | refused: `NotReady` |

use super::Pipeline;
use crate::activity::{Activity, Halt};
use crate::calibrate::Refusal as Unfit;
use crate::command::Command;
use crate::commission::{self, Commissioning, Run, Task};
use crate::contact::Contact;
use crate::frame::Sense;
use crate::grip::Grip;
use crate::identify::{Identification, Press, Refusal};
use crate::safety::guard::Guard;
use crate::state::Fault;
use crate::status::{Taken, Taring};
use crate::touch::{Stage, Touch};
use fixed::types::I8F24;

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// Whether a command asks for something new, or for something that waits.
    #[inline(always)]
    pub(super) fn asked(&self, command: &Command) -> bool {
        let waits = match self.activity {
            Activity::Off(_) | Activity::Strokes(_) => command.torque,
            Activity::Grip(_) => !command.torque,
            Activity::Press(_) => true,
            Activity::Tare { .. } | Activity::Fault(_) => false,
        };
        let taken = &self.status.taken;
        waits
            || command.tare_request != taken.tare
            || command.clear_request != taken.clear
            || command.identify_request != taken.identify
            || command.calibrate_request != taken.calibrate
            || command.forget_request != taken.forget
            || command.commission_request != taken.commission
    }

    /// Serves what a command newly asks for.
    #[inline(never)]
    pub(super) fn serve(&mut self, command: &Command, sense: &Sense, contact: &Contact) {
        let before = self.status.taken;
        if let Activity::Press(press) = &self.activity
            && (!press.running() || press.deep() && !self.calibrator.running())
        {
            self.activity = Activity::Grip(Grip::default());
        }
        self.status.taken = Taken {
            tare: command.tare_request,
            clear: command.clear_request,
            forget: command.forget_request,
            commission: command.commission_request,
            ..before
        };
        if command.forget_request != before.forget {
            self.forget();
        }
        if command.clear_request != before.clear && !command.torque && matches!(self.activity, Activity::Fault(_)) {
            self.status.fault = None;
            self.activity = Activity::Off(Halt::BRAKES);
        }
        if command.tare_request != before.tare {
            self.serve_tare(command.tare_forced);
        }
        if !command.torque && matches!(self.activity, Activity::Grip(_) | Activity::Press(_)) {
            self.leave(Halt::BRAKES);
        }
        let task = Task::of(command.commission_request);
        if command.commission_request != before.commission || command.torque {
            let task = if command.torque { Task::Stop } else { task };
            self.serve_commission(task, command.tare_forced, sense.encoder, contact);
            if command.torque && command.commission_request != before.commission && task != Task::Stop {
                self.status.commissioning = Commissioning::Refused(commission::Refusal::NotReady);
            }
        }
        if command.torque && self.may_drive(command.tare_forced) {
            self.serve_torque(sense.encoder);
        }
        if command.identify_request != before.identify {
            self.serve_press(false, command);
        }
        if command.calibrate_request != before.calibrate {
            self.serve_press(true, command);
        }
    }

    fn serve_tare(&mut self, forced: bool) {
        let pressed = self.tared && self.touch.held() && !forced;
        let halt = match self.activity {
            ref activity if pressed || matches!(activity, Activity::Fault(_)) => {
                self.status.tare = Taring::Refused;
                return;
            }
            Activity::Off(halt) | Activity::Tare { halt, .. } => halt,
            _ => Halt::BRAKES,
        };
        let free = self.touch.stage() == Stage::Clear;
        // Whoever tares a finger outside its travel moved it there: a millimetre outside, where the guard stops it.
        let (travel, one) = (self.motion.observer.travel.0, I8F24::ONE);
        let [end, back] = [self.config.travel_max, self.config.bounds.back].map(|length| length.0.saturating_add(one));
        self.zeroed &= travel <= end && travel.saturating_neg() <= back;
        self.leave(halt);
        self.array.start_tare();
        (self.touch, self.guard) = (Touch::default(), Guard::default());
        (self.tared, self.status.tare) = (false, Taring::Running);
        self.activity = Activity::Tare { halt, free };
    }

    /// Whether torque may be taken up: the readings are those of a free tip.
    fn may_drive(&self, tare_forced: bool) -> bool {
        self.tared && (tare_forced || !self.array.tared_touching())
    }

    fn serve_torque(&mut self, encoder: i32) {
        let Activity::Off(halt) = &mut self.activity else { return };
        if halt.slow(&self.motion, &self.config) {
            self.start(encoder);
            self.activity = Activity::Grip(Grip::default());
        }
    }

    /// The motor is driven from here on: guard and monitor start.
    #[inline(never)]
    fn start(&mut self, encoder: i32) {
        if !self.zeroed {
            self.zeroed = true;
            self.touch.shift(self.motion.observer.zero(encoder, &self.config));
        }
        self.touch.start();
        self.guard.start(encoder, self.motion.observer.origin(), &self.config);
        self.monitor.restart(self.array.picture(), &self.motion);
    }

    #[inline(never)]
    fn serve_commission(&mut self, task: Task, tare_forced: bool, encoder: i32, contact: &Contact) {
        let free = self.may_drive(tare_forced) && contact.force < self.config.contact_on;
        let refusal = match &mut self.activity {
            Activity::Strokes(run) => return run.halt(encoder),
            _ if task == Task::Stop => return,
            Activity::Off(_) if free => {
                if task != Task::Measure || self.config.params.direction_confirmed != 0 {
                    self.start(encoder);
                    self.activity = Activity::Strokes(Run::begun(task, encoder, &self.config));
                    return;
                }
                commission::Refusal::Unconfirmed
            }
            _ => commission::Refusal::NotReady,
        };
        self.status.commissioning = Commissioning::Refused(refusal);
    }

    /// A press that measures Young's modulus, or the taxels' gains.
    #[inline(never)]
    fn serve_press(&mut self, gains: bool, command: &Command) {
        let works = gains && self.calibrator.busy() && !self.calibrator.running();
        let accepted = match &self.activity {
            // The press before has its answer first.
            _ if works => return,
            Activity::Press(press) if press.deep() == gains => true,
            Activity::Grip(_) => {
                self.activity = Activity::Press(Press::begin(gains, &self.motion));
                if gains {
                    self.calibrator.start();
                } else {
                    self.status.identification = Identification::Running;
                }
                true
            }
            Activity::Tare { .. } if command.torque => return,
            Activity::Off(_) | Activity::Press(_) if command.torque && self.may_drive(command.tare_forced) => return,
            _ => false,
        };
        let taken = &mut self.status.taken;
        *(if gains { &mut taken.calibrate } else { &mut taken.identify }) =
            if gains { command.calibrate_request } else { command.identify_request };
        match (accepted, gains) {
            (true, _) => {}
            (false, true) => self.calibrator.refuse(Unfit::NotReady),
            (false, false) => self.status.identification = Identification::Refused(Refusal::NotReady),
        }
    }

    /// Ends what drives the motor, for the reason that something else begins: off, where there is no fault.
    #[inline(never)]
    pub(super) fn leave(&mut self, halt: Halt) {
        match &mut self.activity {
            Activity::Press(press) if press.deep() => self.calibrator.interrupt(),
            Activity::Press(_) => self.status.identification = Identification::Refused(Refusal::Interrupted),
            Activity::Strokes(_) => {
                self.status.commissioning = Commissioning::Refused(commission::Refusal::Interrupted);
            }
            Activity::Tare { .. } if self.status.tare == Taring::Running => self.status.tare = Taring::Refused,
            Activity::Fault(_) => return,
            Activity::Off(_) | Activity::Tare { .. } | Activity::Grip(_) => {}
        }
        self.activity = Activity::Off(halt);
    }

    /// Stops for a reason that the firmware saw (frame guard, broken parameters, crash); latched like any fault.
    #[inline(never)]
    pub fn stop(&mut self, fault: Fault) {
        self.leave(Halt::BRAKES);
        if !matches!(self.activity, Activity::Fault(_)) {
            self.activity = Activity::Fault(fault);
        }
        self.report_activity();
        self.motion.short(&self.config);
        self.status.duty = Default::default();
    }

    /// Forgets what presses and a scale measured: parameters or gains are others now, or the host wants so.
    #[inline(never)]
    pub(super) fn forget(&mut self) {
        self.calibrator.forget();
        self.scale.forget();
        (self.status.calibration, self.status.scale) = (self.calibrator.standing(), self.scale.standing());
    }
}
