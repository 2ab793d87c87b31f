//! The activity of the finger: one variant for each, which owns the state of that activity.
//!
//! Entering an activity creates its state and leaving drops it, so no activity can find what another one left behind.
//! What outlives an activity lies in the [`Pipeline`] and is updated in every frame, as the tactile image with its
//! baseline, the [`crate::touch`], the motion with its zero and winding, and the time budget.
//!
//! # Requests
//!
//! A request is accepted once or refused with its reason, here and nowhere else.
//!
//! | request | accepted | otherwise |
//! | --- | --- | --- |
//! | clear | in fault, with torque off | the fault remains, or there is none |
//! | tare | in every activity but fault and the last release, also in the frame that clears one; not while something has been pressed for 3 ms, unless that was [forced](Command::tare_forced): the zero before remains | refused: [`Taring::Refused`] |
//! | torque on | in off, once the tip is slow; not before a tare, nor after one while something touched the tip, unless that was [forced](Command::tare_forced); not before the direction is confirmed, nor while it has been on since before the tare or the configuration | the finger stays off; limits 6, 10, 14 and 15 give the reason |
//! | torque off | in every activity; a release for a silent bus stops with fault 7 | |
//! | jog, strokes | in off, with torque off, the array tared and nothing at the tip; they wait until the tip is at rest | refused: [`Ended`] |
//! | press | in a grip; with torque on it waits while torque is taken up or a tare is under way | refused: `NotReady` |
//! | stop | always; a motion that still waits ends as [`Ended::Interrupted`] | |

use super::Pipeline;
use crate::command::Command;
use crate::config::Config;
use crate::contact::Contact;
use crate::control::SpeedLoop;
use crate::frame::Sense;
use crate::grip::Grip;
use crate::measure::{BuiltIn, Ended, MeasureState, MeasureStatus, Press, Strokes, Task};
use crate::pressure::TactileImage;
use crate::safety::guard::Guard;
use crate::safety::monitor;
use crate::state::{Fault, Mode};
use crate::status::{AcknowledgedRequests, Taring};
use crate::touch::{Stage, Touch};
use crate::units::{Millimetres, MillimetresPerSecond};
use fixed::types::I8F24;

/// Distance, besides a count of the encoder, within which a tip is at rest: 5 um, Q24 mm.
const REST: i32 = (1 << 24) / 200;
/// Time within that distance after which a tip is at rest, ns.
const REST_NS: u32 = 20_000_000;

/// Activity of the finger.
#[derive(Clone, Debug)]
pub enum Activity {
    /// The motor is not driven: shorted until the tip is at rest, then open.
    Off(Halt),
    /// The zero of every taxel is measured; the motor is not driven.
    Tare {
        /// Braking of the motor.
        halt: Halt,
    },
    /// Approach, hold and release.
    Grip(Grip),
    /// Release because the bus is silent. Whatever arrives meanwhile, it ends with fault 7 (bus silent).
    LastRelease {
        /// The grip that releases.
        grip: Grip,
        /// Time since the bus fell silent, ns.
        ns: u32,
    },
    /// A press that measures tip and array.
    Press(Press),
    /// Motions in the air that measure the drive.
    Strokes(Strokes),
    /// Stopped by a fault.
    Fault(Fault),
}

impl Activity {
    /// Mode as reported.
    pub fn mode(&self, touch: &Touch) -> Mode {
        match self {
            Self::Off(_) => Mode::Off,
            Self::Tare { .. } => Mode::Tare,
            Self::Grip(grip) | Self::LastRelease { grip, .. } => grip.mode(touch),
            Self::Press(_) => Mode::Press,
            Self::Strokes(_) => Mode::Strokes,
            Self::Fault(_) => Mode::Fault,
        }
    }

    /// Returns true in the mode release.
    pub fn releases(&self, touch: &Touch) -> bool {
        matches!(self, Self::Grip(grip) | Self::LastRelease { grip, .. } if grip.mode(touch) == Mode::Release)
    }

    /// Returns true if the motor is driven: then guard and monitor judge the motion.
    pub fn drives(&self) -> bool {
        !matches!(self, Self::Off(_) | Self::Tare { .. } | Self::Fault(_))
    }

    /// Returns true if the contact is fitted to the model. A press must not depend on the configured modulus.
    pub fn fits(&self) -> bool {
        !matches!(self, Self::Press(_) | Self::Strokes(_))
    }

    /// Returns true if the baseline may follow the array's readings.
    pub fn learns(&self) -> bool {
        matches!(self, Self::Off(_) | Self::Grip(_) | Self::LastRelease { .. })
    }
}

/// Braking of a motor that is no longer driven: shorted until the tip is at rest, then open. An open bridge would let
/// a pressed tip fly back, and a moving one run into the object.
#[derive(Clone, Copy, Debug)]
pub struct Halt {
    /// Travel at which the tip last moved.
    at: Millimetres,
    /// Time since then, ns.
    still_ns: u32,
    /// True once the bridge is open.
    open: bool,
}

impl Halt {
    /// A motor that was driven just now, or may have been before a reset.
    pub const BRAKES: Self = Self { at: Millimetres::ZERO, still_ns: 0, open: false };

    /// Returns true if the tip is at rest.
    pub fn rests(&self) -> bool {
        self.still_ns > REST_NS
    }

    /// Takes a frame. Returns true while the motor is shorted.
    pub fn brakes(&mut self, motion: &SpeedLoop, config: &Config) -> bool {
        let travel = motion.observer.travel;
        let moved = travel.0.saturating_sub(self.at.0).saturating_abs().to_bits();
        if moved > REST.saturating_add(config.count.to_bits()) {
            (self.at, self.still_ns) = (travel, 0);
        }
        self.still_ns = self.still_ns.saturating_add(config.timing.frame_ns);
        self.open |= self.rests();
        !self.open
    }

    /// Returns true if the tip is slow enough for the motor to be driven from here. A faster one is braked first.
    pub fn slow(&mut self, motion: &SpeedLoop, config: &Config) -> bool {
        let MillimetresPerSecond(speed) = motion.observer.speed;
        let slow = speed.saturating_abs() <= config.approach.0 / 2;
        if !slow {
            *self = Self::BRAKES;
        }
        slow
    }
}

/// Coarsest encoder for a jog: 0.1 mm a count.
const COARSEST: Millimetres = Millimetres::from_bits((1 << 24) / 10);

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// Returns true if a command has a new request, or one that waits.
    #[inline(always)]
    pub(super) fn asked(&self, command: &Command) -> bool {
        let waits = match self.activity {
            Activity::Off(_) | Activity::Strokes(_) => command.torque,
            Activity::Grip(_) | Activity::LastRelease { .. } => !command.torque,
            Activity::Press(_) => true,
            Activity::Tare { .. } | Activity::Fault(_) => false,
        };
        let taken = &self.status.taken;
        waits
            || command.tare_request != taken.tare
            || command.clear_request != taken.clear
            || command.measure_request != taken.measure
    }

    /// Serves the new requests of a command.
    #[inline(never)]
    pub(super) fn serve(&mut self, command: &Command, sense: &Sense, contact: &Contact) {
        let before = self.status.taken;
        let ran = self.status.measure.state == MeasureState::Running;
        if let Activity::Press(press) = &self.activity
            && !press.running()
        {
            self.end_press();
        }
        self.status.taken = AcknowledgedRequests { tare: command.tare_request, clear: command.clear_request, ..before };
        if command.clear_request != before.clear && !command.torque && matches!(self.activity, Activity::Fault(_)) {
            self.status.fault = None;
            self.activity = Activity::Off(Halt::BRAKES);
        }
        if command.tare_request != before.tare {
            self.serve_tare(command.tare_forced);
        }
        if !command.torque {
            match self.activity {
                Activity::Grip(_) | Activity::Press(_) => self.leave(Halt::BRAKES),
                Activity::LastRelease { .. } => self.stop(Fault::BusSilent),
                _ => {}
            }
        }
        if command.torque {
            if let Activity::Strokes(run) = &mut self.activity {
                run.halt(sense.encoder);
            }
            if self.takes_torque(command.tare_forced) {
                self.serve_torque(sense.encoder);
            }
        }
        // A motion that this command ends closes its record with this frame: the next one begins after it.
        let ended = ran && self.status.measure.state != MeasureState::Running;
        if command.measure_request != before.measure && !ended {
            self.serve_measure(command, sense.encoder, contact);
        }
    }

    fn serve_tare(&mut self, forced: bool) {
        if !self.takes_tare(forced) {
            self.status.tare = Taring::Refused;
            return;
        }
        let halt = match self.activity {
            Activity::Off(halt) | Activity::Tare { halt } => halt,
            _ => Halt::BRAKES,
        };
        // After a release the tip is known to be free.
        let free = self.touch.stage() == Stage::Clear;
        // A finger that is tared outside its travel was moved there: a millimetre outside, where the guard stops it.
        let (travel, one) = (self.motion.observer.travel.0, I8F24::ONE);
        let [end, back] = [self.config.travel_max, self.config.bounds.back].map(|length| length.0.saturating_add(one));
        self.zeroed &= travel <= end && travel.saturating_neg() <= back;
        self.leave(halt);
        self.array.start_tare(free);
        (self.touch, self.guard) = (Touch::default(), Guard::default());
        (self.tared, self.status.tare) = (false, Taring::Running);
        self.activity = Activity::Tare { halt };
    }

    /// Returns true if a tare that is requested now is measured.
    pub(crate) fn takes_tare(&self, forced: bool) -> bool {
        // New parameters reset the record of the touch. Until the next frame renews it, the last contact decides.
        let TactileImage { bad_count, undriven_max, .. } = *self.array.picture();
        let readable = monitor::array_readable(bad_count, undriven_max, &self.config);
        let touches = readable && self.status.contact.force >= self.config.contact_on;
        let unseen = self.touch.stage() == Stage::None && touches;
        let pressed = self.tared && (self.touch.lasts(&self.config) || unseen) && !forced;
        !pressed && !matches!(self.activity, Activity::LastRelease { .. } | Activity::Fault(_))
    }

    /// Returns true if torque may be enabled: it is a new request, and the motor's direction is confirmed.
    fn takes_torque(&self, tare_forced: bool) -> bool {
        self.may_drive(tare_forced) && self.armed && self.config.params.direction_confirmed != 0
    }

    /// Returns true if the motor may be driven: the readings are those of a free tip.
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

    /// Starts guard and monitor: the motor is driven from here on.
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

    /// Serves a request for a motion that measures, or for its end. A press waits for torque that is being enabled;
    /// jog and strokes wait until the tip is at rest.
    #[inline(never)]
    fn serve_measure(&mut self, command: &Command, encoder: i32, contact: &Contact) {
        let task = Task::of(command.measure_request);
        let may_drive = self.may_drive(command.tare_forced);
        let waits = match (task, &mut self.activity) {
            (Task::Press, Activity::Tare { .. }) => command.torque,
            (Task::Press, Activity::Off(_) | Activity::Strokes(_)) => {
                command.torque && self.takes_torque(command.tare_forced)
            }
            (Task::Jog | Task::Strokes, Activity::Off(halt)) => {
                let rests = halt.slow(&self.motion, &self.config) && halt.rests();
                !command.torque && may_drive && !rests
            }
            _ => false,
        };
        if waits {
            return;
        }
        let skipped = task.after(self.status.taken.measure) != command.measure_request;
        self.status.taken.measure = command.measure_request;
        let runs = self.status.measure.state == MeasureState::Running;
        let refusal = match (task, &mut self.activity, BuiltIn::PROOF) {
            (Task::Stop, Activity::Strokes(run), _) => return run.halt(encoder),
            (Task::Stop, Activity::Press(_), _) => {
                self.leave(Halt::BRAKES);
                return self.end_press();
            }
            // A motion waited, and never began.
            (Task::Stop, ..) if skipped => Ended::Interrupted,
            (Task::Stop, ..) => return,
            (Task::Press, Activity::Grip(_), Some(built_in)) => {
                self.status.measure = MeasureStatus::running(task);
                // Farther back than a release only a residue touches, or an object that pushes.
                let behind = contact.indentation.0.saturating_add(self.config.clearance.0);
                let rest = Millimetres(self.motion.observer.travel.0.saturating_sub(behind));
                self.touch.doubt_place();
                self.activity = Activity::Press(Press::begin(&self.motion, rest, built_in));
                return;
            }
            // The motion under way answers both requests.
            _ if runs => return,
            (Task::Jog | Task::Strokes, Activity::Off(_), Some(built_in))
                if !command.torque
                    && may_drive
                    && contact.force < self.config.contact_on
                    && self.config.count <= COARSEST =>
            {
                if task == Task::Jog || self.config.params.direction_confirmed != 0 {
                    self.start(encoder);
                    self.status.measure = MeasureStatus::running(task);
                    self.activity = Activity::Strokes(Strokes::begin(task, encoder, built_in));
                    return;
                }
                Ended::Unconfirmed
            }
            _ => Ended::NotReady,
        };
        self.status.measure = MeasureStatus::over(task, refusal, 0);
    }

    /// Goes from a press to a grip: what the array still reads may be a residue.
    fn end_press(&mut self) {
        self.touch.doubt_place();
        self.activity = Activity::Grip(Grip::default());
    }

    /// Ends the activity, because something else begins: the new one is off, unless there is a fault.
    #[inline(never)]
    pub(super) fn leave(&mut self, halt: Halt) {
        match &mut self.activity {
            Activity::Press(_) | Activity::Strokes(_) => self.status.measure.end(Ended::Interrupted, 0),
            Activity::Tare { .. } if self.status.tare == Taring::Running => self.status.tare = Taring::Refused,
            Activity::Fault(_) => return,
            Activity::Off(_) | Activity::Tare { .. } | Activity::Grip(_) | Activity::LastRelease { .. } => {}
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
}
