//! The path of a frame from codes to duty, as [`Pipeline::step`] takes it while a force is held:
//!
//! | stage | file | from | to |
//! | --- | --- | --- | --- |
//! | fit level | `pipeline/budget.rs` | time of the last answer | rows of the fit in this frame |
//! | motion | `control.rs` | encoder count, last g V - c v (Q8 mm/s^2) | travel (Q24 mm), speed (Q16 mm/s), disturbance (Q8 mm/s^2) |
//! | array | `pressure.rs`, by the pass of `lanes/src/rows.rs` | codes | sixteenths of a code above the tare, their sum and moments, flags |
//! | contact | `contact.rs`, `contact/fit.rs` | sums; a row of taxels | force (Q16 N), centre (Q24 mm), uncertainty |
//! | requests | `pipeline/activity.rs` | the command | tare, clear, another activity |
//! | faults | `safety/monitor.rs`, `safety/guard.rs` | array, supply, bus; encoder, force, last g V | a fault, or none |
//! | touch | `touch.rs` | force, travel | the surface, how well it is known, and a withheld force |
//! | goal | `grip.rs`, `model.rs`, `control.rs` | goal and force (Q16 N), each as an indentation | distance to go (Q24 mm), largest speed |
//! | law | `control.rs` | distance, speed, disturbance | requested g V (Q8 mm/s^2) |
//! | limits | `control/drive.rs` | requested g V, supply (mV) | g V within slew, current and voltage; duty (Q15) |
//! | last check | `safety/guard.rs` | duty | the duty, or 0 |
//! | result | `status.rs` | mode, duty | state of the bridge: driven by the duty, shorted, or open |

mod activity;
pub mod budget;

pub use crate::status::{AcknowledgedRequests, Bridge, Status, Taring};

use crate::command::Command;
use crate::config::Shaped;
use crate::contact::{self, Contact, Fit};
use crate::control::{SpeedLoop, TemperatureDrift, Winding};
use crate::frame::{Frame, Sense, Shape};
use crate::grip::{Goal, Grip};
use crate::measure::strokes::{self, Kept};
use crate::measure::{Row, press};
use crate::pressure::{Array, Calibration, TactileImage};
use crate::safety::guard::{Guard, Seen};
use crate::safety::monitor::{self, Monitor, MonitorInputs};
use crate::state::{Fault, Limits};
use crate::touch::{Stage, Touch, TouchInputs};
use crate::units::{Duty, Newtons};
use activity::{Activity, Halt};
use budget::Budget;

/// Steps in a row without a new frame that are a fault. At the second one the newest frame is two frame times old; the
/// board's guard trips after 1.75.
const REPEATED_MAX: u32 = 2;
/// Longest release after the bus fell silent, ns.
const LAST_RELEASE_NS: u32 = 500_000_000;

/// The loop's state between frames. The example at the crate's top closes a loop with it.
///
/// The order of the fields is deliberate: the fields that every frame uses lie in the first 4 KiB, which an
/// instruction reaches with its offset.
#[derive(Clone, Debug)]
#[repr(C)]
pub struct Pipeline<const ROWS: usize, const COLUMNS: usize> {
    status: Status,
    tared: bool,
    /// Number of steps in a row that brought no new frame; none before the first step.
    repeated: Option<u32>,
    /// True once the travel has its zero: the place where the motor was first driven.
    zeroed: bool,
    /// True once torque was off in a frame after which the array had a zero or was about to get one: torque may be
    /// enabled. Torque that has been on for longer drives nothing until it was off.
    armed: bool,
    /// Torque of the last command; on before the first one.
    torque: bool,
    motion: SpeedLoop,
    touch: Touch,
    temperature_drift: TemperatureDrift,
    monitor: Monitor,
    guard: Guard,
    activity: Activity,
    fit: Fit<ROWS, COLUMNS>,
    array: Array<ROWS, COLUMNS>,
    config: Shaped<ROWS, COLUMNS>,
    budget: Budget<ROWS, COLUMNS>,
    step: press::Step<ROWS, COLUMNS>,
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
            touch: Touch::default(),
            temperature_drift: TemperatureDrift::default(),
            monitor: Monitor::default(),
            guard: Guard::default(),
            activity: Activity::Off(Halt::BRAKES),
            step: press::Step::NONE,
            status: Status::default(),
            tared: false,
            repeated: None,
            zeroed: false,
            armed: false,
            torque: true,
        }
    }

    /// Computes the duty from a frame. Infallible: accepts any frame, any sense and any command. The status is lent:
    /// to copy it takes as long as the speed law.
    // One function in the image: what it calls is inlined, but for what few frames need.
    #[inline(never)]
    pub fn step(&mut self, frame: &Frame<ROWS, COLUMNS>, sense: &Sense, command: &Command) -> (Duty, &Status) {
        let mut limits = self.count_frames(frame.sequence);
        self.set_fit_level(command, sense, &mut limits);
        self.motion.observe(sense.encoder, &self.config);
        self.temperature_drift.observe(sense.chip, &self.config);
        self.monitor.watch_supply(sense, &self.config);

        // The tactile image and the contact in it. With a broken array a driven finger keeps the last
        // contact, and the motor gets no voltage by it.
        let TactileImage { bad_count, undriven_max, .. } = *self.array.read(frame, &self.config);
        let readable = monitor::array_readable(bad_count, undriven_max, &self.config);
        let contact = self.contact(readable);

        // Requests of the host, and reasons to stop.
        let no_new_tare = command.tare_request == self.status.taken.tare;
        let zeroes = self.tared || !no_new_tare || matches!(self.activity, Activity::Tare { .. });
        self.armed = zeroes && (self.armed || !self.torque);
        self.torque = command.torque;
        if self.asked(command) {
            self.serve(command, sense, &contact);
        }
        let summed = self.array.picture().force(&self.config);
        if let Some(fault) = self.judge(&contact, readable.then_some(summed), sense, command) {
            self.stop(fault);
        }

        // The duty of the activity, and the guard's limit of it.
        if readable && self.tared {
            let presses = !self.activity.releases(&self.touch);
            let Self { touch, guard, config, motion, .. } = self;
            let travel = motion.observer.travel;
            let inputs = TouchInputs { contact: &contact, summed, travel, presses };
            touch.observe(&inputs, || guard.depth_by_motor(config), config);
            self.learn_baseline(contact.force);
        }
        let requested = self.act(&contact, [readable, no_new_tare], sense, command, &mut limits);
        let duty = if readable { self.guard.permit(requested, &mut limits) } else { Duty::ZERO };
        if duty != requested {
            self.motion.drive.block();
        }

        self.report(duty, &contact, sense, command, limits);
        (duty, &self.status)
    }

    /// Counts missed frames from the gap in the sequence. A number that does not grow is a frame that was there before.
    fn count_frames(&mut self, sequence: u32) -> Limits {
        let mut limits = Limits::default();
        let step = sequence.wrapping_sub(core::mem::replace(&mut self.status.sequence, sequence)).cast_signed();
        if let Some(repeated) = self.repeated.replace(0) {
            limits.set(if step == 1 { 0 } else { Limits::FRAME_MISSED });
            if step > 0 {
                self.status.missed_frames = self.status.missed_frames.wrapping_add(step.cast_unsigned() - 1);
            } else {
                self.repeated = Some(repeated.saturating_add(1));
            }
        }
        limits
    }

    fn set_fit_level(&mut self, command: &Command, sense: &Sense, limits: &mut Limits) {
        let fit_level = self.budget.next(command.fit_level, sense.answer, self.config.timing.deadline);
        self.fit.set_fit_level(fit_level);
        self.status.fit_level = fit_level;
        if fit_level < command.fit_level {
            limits.set(Limits::FIT_LEVEL);
        }
    }

    /// Computes the contact in the tactile image. Before a tare the array's offsets look like a contact, so none is
    /// reported.
    fn contact(&mut self, readable: bool) -> Contact {
        let fits = readable && self.activity.fits();
        let contact = if !self.tared {
            Contact { bad_taxels: self.array.picture().bad_count.min(255) as u8, ..Contact::default() }
        } else if fits {
            self.fit.read(self.array.picture(), &self.config)
        } else if readable || !self.activity.drives() {
            contact::from_sums(self.array.picture(), &self.config)
        } else {
            self.status.contact
        };
        if !self.activity.fits() {
            self.fit.lose();
        }
        // A tare takes its own time, without the model.
        let tares = matches!(self.activity, Activity::Tare { .. });
        self.budget.note((!tares).then_some(fits && self.fit.at_work()));
        contact
    }

    /// Returns the first reason to stop, the most direct evidence first. While the motor is not driven, only a tare
    /// has reasons: a broken array, a silent bus and the bridge end it.
    fn judge(&mut self, contact: &Contact, summed: Option<Newtons>, sense: &Sense, command: &Command) -> Option<Fault> {
        let drives = self.activity.drives();
        let picture = self.array.picture();
        let seen = Seen {
            encoder: sense.encoder,
            force: summed.map_or(contact.force, |summed| summed.max(contact.force)),
            pressing: !self.activity.releases(&self.touch),
            goal: command.goal,
            given_q8_mm_per_s2: self.motion.drive.given(),
        };
        let unsafe_motion = if drives || self.tared { self.guard.check(&seen, drives, &self.config) } else { None };
        if !drives && !matches!(self.activity, Activity::Tare { .. }) {
            return None;
        }
        if sense.bridge_fault {
            return Some(Fault::Bridge);
        }
        if self.repeated >= Some(REPEATED_MAX) {
            return Some(Fault::LostFrames);
        }
        if let Some(fault) = monitor::array_broken(picture, &self.config) {
            return Some(fault);
        }
        let pressed = self.guard.presses_in();
        let view = MonitorInputs { picture, contact, pressed, sense, motion: &self.motion, command };
        let fault = if drives { self.monitor.check(&view, &self.config) } else { None };
        fault.or(unsafe_motion).or_else(|| self.judge_bus(sense, command))
    }

    /// Returns a fault for a silent bus. A silent host cannot end a press, so the finger releases the object by
    /// itself, then stops.
    fn judge_bus(&mut self, sense: &Sense, command: &Command) -> Option<Fault> {
        let silent = command.bus_watchdog_ms != 0 && sense.bus_silent_ms >= command.bus_watchdog_ms;
        if silent {
            self.release_for_silence();
        }
        let Activity::LastRelease { ns, .. } = &mut self.activity else { return silent.then_some(Fault::BusSilent) };
        let clear = matches!(self.touch.stage(), Stage::None | Stage::Clear);
        let rests = self.motion.observer.speed.0.saturating_abs() <= self.config.approach.0 / 16;
        let too_long = *ns > LAST_RELEASE_NS;
        *ns = ns.saturating_add(self.config.timing.frame_ns);
        (clear && rests || too_long).then_some(Fault::BusSilent)
    }

    #[cold]
    #[inline(never)]
    fn release_for_silence(&mut self) {
        let grip = match self.activity {
            Activity::Grip(grip) => grip,
            Activity::Press(_) => Grip::default(),
            _ => return,
        };
        self.leave(Halt::BRAKES);
        self.activity = Activity::LastRelease { grip, ns: 0 };
    }

    /// Lets the baseline learn what the array reads without a contact.
    #[inline(always)]
    fn learn_baseline(&mut self, force: Newtons) {
        if self.config.params.baseline_follows == 0 || !self.activity.learns() {
            return;
        }
        if let Some(weight) = self.touch.learns(force, ROWS as u32, &self.config) {
            let share = self.array.follow_drift(weight);
            self.temperature_drift.zero(share);
        }
    }

    /// Runs a frame of the activity, and returns the duty that it wants. An activity that ends makes way for the next
    /// one.
    #[inline(always)]
    fn act(
        &mut self,
        contact: &Contact,
        [readable, no_new_tare]: [bool; 2],
        sense: &Sense,
        command: &Command,
        limits: &mut Limits,
    ) -> Duty {
        self.status.drift = self.temperature_drift.force(command.goal, &self.config);
        let applied = i64::from(self.status.duty.0) * i64::from(sense.supply_mv);
        let force = if matches!(self.activity, Activity::LastRelease { .. }) { Newtons::ZERO } else { command.goal };
        let Self { activity, motion, touch, config, array, status, step, .. } = self;
        let (picture, supply_mv) = (array.picture(), sense.supply_mv);
        let reference = match activity {
            Activity::Grip(grip) | Activity::LastRelease { grip, .. } => {
                let goal = Goal { force, drift: status.drift };
                grip.reference(&goal, contact, touch, motion, config, limits)
            }
            Activity::Press(press) => {
                let view = press::PressInputs {
                    sequence: status.sequence,
                    picture,
                    contact,
                    lasts: touch.lasts(config),
                    encoder: sense.encoder,
                    motion,
                    applied_mv: (applied >> 15) as i32,
                    chip: sense.chip,
                };
                press.observe(&view, step, &mut status.measure, config);
                press.reference(motion, config, limits)
            }
            Activity::Strokes(run) => {
                // The sums of a broken array mean nothing.
                let force = if readable { contact.force.max(picture.force(config)) } else { contact.force };
                let view =
                    strokes::StrokeInputs { encoder: sense.encoder, force, supply_mv, applied: (applied >> 13) as i32 };
                run.observe(&view, &mut status.measure, config);
                let voltage = config.push(run.voltage_mv());
                if !run.running() {
                    (*activity, status.braking) = (Activity::Off(Halt::BRAKES), true);
                }
                return motion.apply_voltage(voltage, supply_mv, config, limits);
            }
            Activity::Off(_) | Activity::Tare { .. } | Activity::Fault(_) => {
                self.rest(readable && no_new_tare);
                return Duty::ZERO;
            }
        };
        motion.follow(reference, supply_mv, config, limits)
    }

    /// A frame in which the motor is not driven.
    #[inline(never)]
    fn rest(&mut self, tare_goes_on: bool) {
        let Self { activity, motion, config, array, status, .. } = self;
        status.braking = match activity {
            Activity::Off(halt) | Activity::Tare { halt } => halt.brakes(motion, config),
            _ => true,
        };
        if status.braking {
            motion.short(config)
        } else {
            motion.coast()
        }
        let Activity::Tare { halt } = activity else { return };
        // Not in the frame with the request, which was read with the tare before.
        if tare_goes_on && array.continue_tare() {
            array.judge_tare(config);
            (self.tared, status.tare) = (true, Taring::Done);
            *activity = Activity::Off(*halt);
        }
        self.temperature_drift.zero(1 << 16);
    }

    #[inline(always)]
    fn report(&mut self, duty: Duty, contact: &Contact, sense: &Sense, command: &Command, mut limits: Limits) {
        // One after the other: the compiler would make a table and a loop.
        let mut note = |held: bool, flag: u16| limits.set(if held { flag } else { 0 });
        note(self.array.picture().bad_count > 0, Limits::TAXELS);
        note(!self.tared, Limits::NOT_TARED);
        note(self.array.tared_touching(), Limits::TARED_TOUCHING);
        note(self.config.params.direction_confirmed == 0, Limits::DIRECTION);
        note(command.torque && !self.armed, Limits::TORQUE_HELD);
        self.report_activity();
        self.status.creep = match &self.activity {
            Activity::Grip(grip) | Activity::LastRelease { grip, .. } => grip.creep.force(),
            _ => Newtons::ZERO,
        };
        self.status.limits = limits;
        self.status.contact = *contact;
        self.status.travel = self.motion.observer.travel;
        self.status.speed = self.motion.observer.speed;
        self.status.duty = duty;
        self.status.chip = sense.chip;
        self.status.winding = self.motion.winding.temperature(&self.config);
    }

    /// Reports what the finger does.
    fn report_activity(&mut self) {
        self.status.mode = self.activity.mode(&self.touch);
        if let Activity::Fault(fault) = self.activity {
            self.status.fault = Some(fault);
        }
    }

    /// Reads the first `rows` of a frame whose later rows are still being scanned, so that the step with the frame takes
    /// less time. It may be left out: the step gives the same result.
    ///
    /// Returns true if, with the later rows of the last step, the array seems broken: the caller must then short the
    /// motor. A taxel that fails just after it was read is seen a frame later; without this check the motor would be
    /// driven until that frame's end. The step decides if it is a fault.
    pub fn begin(&mut self, frame: &Frame<ROWS, COLUMNS>, rows: usize) -> bool {
        let (bad_count, undriven_max) = self.array.begin(frame, rows, &self.config);
        let broken = self.activity.drives() && !monitor::array_readable(bad_count, undriven_max, &self.config);
        if broken {
            self.motion.drive.block();
            self.status.duty = Duty::ZERO;
        }
        broken
    }

    /// Replaces the configuration; the mode becomes off unless it is fault. The tare is kept; a tare under way starts
    /// again, as does the contact's fit.
    pub fn configure(&mut self, config: &Shaped<ROWS, COLUMNS>) {
        self.config = config.clone();
        self.array.begin_again();
        self.restart();
    }

    /// Replaces the taxels' gains and mask; the mode becomes off unless it is fault, and a new tare is needed. A tare
    /// under way starts again.
    pub fn calibrate(&mut self, calibration: &Calibration<ROWS, COLUMNS>) {
        self.array.calibrate(calibration);
        self.tared = false;
        self.restart();
    }

    fn restart(&mut self) {
        self.armed = false;
        self.fit.lose();
        self.touch = Touch::default();
        match self.activity {
            Activity::Tare { .. } => self.array.start_tare(false),
            Activity::Off(_) => {}
            Activity::LastRelease { .. } => self.stop(Fault::BusSilent),
            _ => {
                self.leave(Halt::BRAKES);
                self.status.braking = true;
            }
        }
        self.report_activity();
    }

    /// Resets everything but the configuration and the taxels' gains: mode off, not tared, nothing measured, torque off
    /// until now; a tip that still moves is braked. Requests
    /// with the numbers in `taken` count as acknowledged, and `missed_frames` as missed before. The winding's
    /// temperature is restored.
    pub fn renew(&mut self, taken: AcknowledgedRequests, missed_frames: u32, winding: Winding) {
        self.array.renew();
        self.budget = Budget::new();
        self.fit = Fit::default();
        self.motion = SpeedLoop { winding, ..SpeedLoop::new() };
        (self.touch, self.temperature_drift) = (Touch::default(), TemperatureDrift::default());
        (self.monitor, self.guard) = (Monitor::default(), Guard::default());
        self.activity = Activity::Off(Halt::BRAKES);
        self.status = Status { taken, missed_frames, ..Status::default() };
        (self.tared, self.repeated, self.zeroed) = (false, None, false);
        (self.armed, self.torque) = (false, false);
    }

    /// Report of the last step.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// The array with its last image and its calibration.
    pub fn array(&self) -> &Array<ROWS, COLUMNS> {
        &self.array
    }

    /// Row that the last step adds to the record of a motion that measures.
    pub fn row(&self) -> Option<Row<'_, ROWS, COLUMNS>> {
        match &self.activity {
            Activity::Press(press) => press.part().map(|part| Row::Step(&self.step, part)),
            Activity::Strokes(run) => run.row().map(|kept| match kept {
                Kept::Stroke => Row::Stroke,
                Kept::Sample(count, voltage) => Row::Sample { count, voltage },
            }),
            _ => None,
        }
    }

    /// Count of the encoder that is zero in such a record: of travel 0, or where the strokes began.
    pub fn measured_from(&self) -> i32 {
        if let Activity::Strokes(run) = &self.activity { run.origin() } else { self.motion.observer.origin() }
    }

    /// The configuration in force.
    pub fn config(&self) -> &Shaped<ROWS, COLUMNS> {
        &self.config
    }

    /// Thermal state of the motor's winding.
    pub fn winding(&self) -> &Winding {
        &self.motion.winding
    }
}
