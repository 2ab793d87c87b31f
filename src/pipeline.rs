//! One frame's way from codes to duty.

mod between;
pub mod budget;
mod modes;
mod report;
mod requests;
mod words;

pub use report::{Bridge, Status, Taken, Taring};

use crate::calibrate::scale::Scale;
use crate::calibrate::{Calibrator, Proposal, Refusal as Unfit};
use crate::command::Command;
use crate::commission::{self, Run, Task};
use crate::config::Shaped;
use crate::contact::{self, Contact, Fit};
use crate::control::SpeedLoop;
use crate::control::goal::Goal;
use crate::control::observer::Observer;
use crate::frame::{Frame, Sense, Shape};
use crate::identify::{Press, PressView, Refusal};
use crate::pressure::Array;
use crate::safety::guard::{Guard, Seen};
use crate::safety::monitor::{self, Monitor, View};
use crate::state::{Fault, Limits, Mode};
use crate::units::{Duty, Newtons};
use budget::Budget;

/// The loop's state between frames. The example at the crate's top closes a loop with it.
///
/// In the order of the fields: what every frame uses lies in the first 4 KiB, which an instruction reaches by itself.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Pipeline<const ROWS: usize, const COLUMNS: usize> {
    status: Status,
    tared: bool,
    motion: SpeedLoop,
    monitor: Monitor,
    guard: Guard,
    goal: Goal,
    fit: Fit<ROWS, COLUMNS>,
    array: Array<ROWS, COLUMNS>,
    config: Shaped<ROWS, COLUMNS>,
    budget: Budget<ROWS, COLUMNS>,
    scale: Scale,
    press: Press,
    commission: Run,
    calibrator: Calibrator<ROWS, COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// A pipeline in the mode off. Inlined, so that it lies on the stack once while it is made, not twice.
    #[inline(always)]
    pub fn new(config: &Shaped<ROWS, COLUMNS>) -> Self {
        const { Shape::<ROWS, COLUMNS>::CHECKED };
        Self {
            config: config.clone(),
            array: Array::new(),
            budget: Budget::new(),
            fit: Fit::default(),
            motion: SpeedLoop::new(),
            monitor: Monitor::default(),
            guard: Guard::default(),
            goal: Goal::default(),
            press: Press::new(),
            commission: Run::new(),
            calibrator: Calibrator::new(),
            scale: Scale::new(),
            status: Status::default(),
            tared: false,
        }
    }

    /// What the last step reported.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// The array's last picture and its calibration.
    pub fn array(&self) -> &Array<ROWS, COLUMNS> {
        &self.array
    }

    /// The gains that presses propose.
    pub fn proposal(&self) -> &Proposal<ROWS, COLUMNS> {
        self.calibrator.proposal()
    }

    /// The configuration in force.
    pub fn config(&self) -> &Shaped<ROWS, COLUMNS> {
        &self.config
    }

    /// One frame's way from codes to duty. Infallible: any frame, any sense, any command. The status is lent: to copy
    /// it takes as long as the speed law.
    // One function, however it is called: what it takes in turn has one caller each and goes into it.
    #[inline(never)]
    pub fn step(&mut self, frame: &Frame<ROWS, COLUMNS>, sense: &Sense, command: &Command) -> (Duty, &Status) {
        let mut limits = self.count_frames(frame.sequence);
        let asked = self.take_requests(command);
        let fit_level = self.budget.next(command.fit_level, sense.answer, self.config.timing.deadline);
        self.fit.set_fit_level(fit_level);
        if fit_level < command.fit_level {
            limits.set(Limits::FIT_LEVEL);
        }

        // What the array feels, where it can be trusted: the bridge does not wait for the rest. The frame that turns
        // torque on drives already, so it is judged like all after it.
        let drives = command.torque || asked.commission.is_some_and(|task| task != Task::Stop);
        let starting = self.status.mode == Mode::Off && drives && self.tared && !asked.tare;
        let watched = self.watched() || starting;
        let picture = self.array.read(frame, &self.config);
        let broken = monitor::array_broken(picture, &self.config);
        let fault = if sense.bridge_fault { Some(Fault::Bridge) } else { broken };
        if let Some(fault) = fault.filter(|_| watched) {
            self.stop(fault);
            self.refuse(asked, command);
            return (Duty::ZERO, &self.status);
        }
        // A press that measures the modulus must not lean on the configured one, as the fit does; nor is there anything
        // to fit to in a broken array. Where a frame shows nothing while the bridge is driven, the contact is the last
        // one's.
        let sound = monitor::array_sound(picture, &self.config);
        let fits = sound && !matches!(self.status.mode, Mode::Identify | Mode::Commission);
        if matches!(self.status.mode, Mode::Identify | Mode::Commission) {
            self.fit.lose();
        }
        let contact = if fits {
            self.fit.read(picture, &self.config)
        } else if sound || !watched {
            contact::from_sums(picture, &self.config)
        } else {
            self.status.contact
        };
        self.budget.note(fits && self.fit.at_work());
        if picture.bad_count > 0 {
            limits.set(Limits::TAXELS);
        }

        self.goal.warmth.observe(sense.chip, &self.config);

        // What the finger does.
        self.motion.observe(sense.encoder, &self.config);
        if starting {
            self.motion.observer = Observer::zeroed_at(sense.encoder);
            self.goal.start();
        }

        // Whether that is sound.
        let driven = watched && self.status.mode != Mode::Tare;
        let seen = Seen {
            encoder: sense.encoder,
            force: if sound { contact.force.max(picture.force(&self.config)) } else { contact.force },
            pressing: self.status.mode != Mode::Release,
            voltage: self.motion.drive.voltage(),
        };
        if starting {
            self.guard = Guard::start(sense.encoder, &self.config);
        }
        let unsafe_motion = if driven { self.guard.check(&seen, &self.config) } else { None };
        let pressed = self.guard.presses_in();
        let view = View { picture, contact: &contact, pressed, sense, motion: &self.motion, command };
        if starting {
            self.monitor.restart(&view);
        }
        let unsound = if watched { self.monitor.check(&view, driven, &self.config) } else { None };
        if let Some(fault) = unsound.or(unsafe_motion) {
            self.status.mode = Mode::Fault;
            self.status.fault = Some(fault);
        }

        // What a press that measures the modulus makes of it.
        if self.status.mode == Mode::Identify {
            let view = PressView { picture, contact: &contact, encoder: sense.encoder, motion: &self.motion };
            self.press.observe(&view, &self.config);
            self.calibrator.observe(&view, &self.config);
        }

        // What motions that measure the drive make of it.
        if self.status.mode == Mode::Commission {
            let held_back = self.motion.drive.voltage() != self.config.push(self.commission.voltage_mv());
            let view =
                commission::View { encoder: sense.encoder, force: seen.force, supply_mv: sense.supply_mv, held_back };
            self.commission.observe(&view, &self.config);
        }

        // What to do about it.
        let mode = self.next_mode(asked, command, &contact, sound, sense.encoder);
        self.status.mode = mode;
        if self.press.running() && mode != Mode::Identify {
            self.press.refuse(Refusal::Interrupted);
        }
        if mode != Mode::Commission {
            self.interrupt_commission();
        }
        if mode != Mode::Identify {
            self.calibrator.interrupt();
        }
        if mode == Mode::Identify {
            self.goal.measures();
        }
        let reference = match mode {
            Mode::Off | Mode::Tare | Mode::Fault | Mode::Commission => None,
            Mode::Approach | Mode::Force | Mode::Release => {
                Some(self.goal.reference(mode, command.goal, &contact, &mut self.motion, &self.config, &mut limits))
            }
            Mode::Identify if self.calibrator.running() => {
                Some(self.calibrator.reference(&mut self.motion, &self.config, &mut limits))
            }
            Mode::Identify => Some(self.press.reference(&mut self.motion, &self.config, &mut limits)),
        };
        let duty = match reference {
            Some(reference) => self.motion.follow(reference, sense.supply_mv, &self.config, &mut limits),
            None if mode == Mode::Commission => {
                let voltage = self.config.push(self.commission.voltage_mv());
                self.motion.push(voltage, sense.supply_mv, &self.config, &mut limits)
            }
            None => self.motion.coast(),
        };
        // Nor does it drive by a frame that shows nothing: for that long the motor is shorted.
        let allowed = if sound { self.guard.allow(duty, &mut limits) } else { Duty::ZERO };
        if allowed != duty {
            self.motion.drive.cut();
        }
        let duty = allowed;
        if !self.tared {
            limits.set(Limits::NOT_TARED);
        }
        if self.array.tared_touching() {
            limits.set(Limits::TARED_TOUCHING);
        }

        self.calibrator.work(&self.array, &self.config);
        self.status.drift = self.goal.warmth.force(command.goal, &self.config);
        let held = self.goal.creep.less(contact.force).0.saturating_sub(self.status.drift.0);
        self.scale.observe(mode, command.goal, Newtons(held), &self.config);
        if command.shown_request != self.status.taken.shown {
            self.status.taken.shown = command.shown_request;
            self.scale.take(command.shown_mn, &contact);
        }
        self.status.scale = self.scale.standing();
        self.status.identification = self.press.outcome();
        self.status.commissioning = self.commission.outcome();
        self.status.calibration = self.calibrator.standing();
        self.status.limits = limits;
        self.status.fit_level = fit_level;
        self.status.contact = contact;
        self.status.travel = self.motion.observer.travel;
        self.status.speed = self.motion.observer.speed;
        self.status.duty = duty;
        self.status.creep = self.goal.creep.force();
        self.status.chip = sense.chip;
        self.status.winding = self.motion.winding.temperature(&self.config);
        (duty, &self.status)
    }

    /// Ends motions that measure the drive, for the reason that another mode begins.
    fn interrupt_commission(&mut self) {
        if self.commission.running() {
            self.commission.refuse(commission::Refusal::Interrupted);
            self.status.commissioning = self.commission.outcome();
        }
    }

    /// Whether faults count: not while the bridge is off anyhow.
    fn watched(&self) -> bool {
        !matches!(self.status.mode, Mode::Off | Mode::Fault)
    }

    /// Counts missed frames from the gap in the sequence.
    fn count_frames(&mut self, sequence: u32) -> Limits {
        let mut limits = Limits::default();
        let missed = sequence.wrapping_sub(self.status.sequence).wrapping_sub(1);
        if self.status.sequence != 0 && missed != 0 {
            self.status.missed_frames = self.status.missed_frames.wrapping_add(missed);
            limits.set(Limits::FRAME_MISSED);
        }
        self.status.sequence = sequence;
        limits
    }
}
