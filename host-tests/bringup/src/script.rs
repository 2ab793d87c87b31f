//! What is asked of the finger on the chip, as in the demonstration, and how its force answers.

use crate::finger::Finger;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::contact::FitLevel;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{Frame, Pipeline, TARE_FRAMES};
use fingertip::units::{CoreCycles, Newtons};
use images::record::{Digest, Record};

/// Goals in mN, and number of frames for which each is held; 0 releases. The first approach is 5 mm long.
pub const GOALS: [(i32, u32); 6] =
    [(1_000, 5_000), (200, 2_500), (2_000, 2_500), (5_000, 2_500), (1_000, 2_500), (0, 1_000)];
/// The goals among them that are steps from one force to another.
pub const STEPS: core::ops::Range<usize> = 1..5;
/// Frames from the start to torque on, longer than the tare.
const TORQUE_AT: u32 = TARE_FRAMES + 20;
/// The first goal.
const FIRST_AT: u32 = TORQUE_AT + 20;
/// Records that the step is studied on, with the wall so near: most of them in contact.
pub const RECORDS: u32 = 1_200;
const NEAR_MM: f32 = 1.0;
/// The wall of the demonstration.
const WALL_MM: f32 = 5.0;
/// A step counts as settled inside this share of the goal or of the step, whichever is smaller.
const SETTLED_SHARE: f32 = 0.02;

const AT_REST: Sense =
    Sense { encoder: 0, supply_mv: 6_000, bus_silent_ms: 0, bridge_fault: false, chip: None, answer: CoreCycles(0) };
/// A tare first of all.
const UNASKED: Command = Command {
    torque: false,
    goal: Newtons::from_bits(0),
    bus_watchdog_ms: 0,
    fit_level: FitLevel::OneRow,
    tare_request: 0,
    tare_forced: false,
    clear_request: 0,
    measure_request: 0,
};

/// Response of the force to a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Which of [`GOALS`].
    pub goal: usize,
    /// Time from 10 % to 90 % of the step, ms.
    pub rise_ms: f32,
    /// Overshoot as a share of the goal or of the step, whichever is smaller.
    pub overshoot_percent: f32,
    /// Time until the force stays within 2 %, ms; negative if it never does.
    pub settled_ms: f32,
}

/// Force during a step to a goal.
#[derive(Clone, Copy)]
struct Way {
    from_n: f32,
    goal_n: f32,
    frames: f32,
    share: f32,
    tenth: Option<f32>,
    nine_tenths: Option<f32>,
    beyond_n: f32,
    inside_since: Option<f32>,
}

impl Way {
    const fn new(from_n: f32, goal_n: f32) -> Self {
        let (tenth, nine_tenths, inside_since) = (None, None, None);
        Self { from_n, goal_n, frames: 0.0, share: 0.0, tenth, nine_tenths, beyond_n: 0.0, inside_since }
    }

    fn unit_n(&self) -> f32 {
        (self.goal_n - self.from_n).abs().min(self.goal_n)
    }

    fn add(&mut self, force_n: f32) {
        let way_n = self.goal_n - self.from_n;
        let share = (force_n - self.from_n) / way_n;
        for (part, reached) in [(0.1, &mut self.tenth), (0.9, &mut self.nine_tenths)] {
            if reached.is_none() && share >= part {
                *reached = Some(self.frames - (share - part) / (share - self.share));
            }
        }
        self.share = share;
        let error_n = force_n - self.goal_n;
        self.beyond_n = self.beyond_n.max(error_n * way_n.signum());
        if error_n.abs() > SETTLED_SHARE * self.unit_n() {
            self.inside_since = None;
        } else if self.inside_since.is_none() {
            self.inside_since = Some(self.frames);
        }
        self.frames += 1.0;
    }

    fn answer(&self, goal: usize, frame_ms: f32) -> Answer {
        let rise = self.nine_tenths.zip(self.tenth).map(|(late, early)| late - early);
        Answer {
            goal,
            rise_ms: rise.unwrap_or(-1.0) * frame_ms,
            overshoot_percent: 100.0 * self.beyond_n / self.unit_n(),
            settled_ms: self.inside_since.unwrap_or(-1.0) * frame_ms,
        }
    }
}

/// Finger and host: everything around the control step.
pub struct Bench {
    /// The finger.
    pub finger: Finger,
    frame: Frame,
    sense: Sense,
    command: Command,
    frames: u32,
    goal: Option<usize>,
    until: u32,
    way: Way,
}

impl Bench {
    /// Bench at rest, before the tare; [`Finger::make_table`] must be called.
    pub const fn new() -> Self {
        Self {
            finger: Finger::new(WALL_MM),
            frame: Frame::EMPTY,
            sense: AT_REST,
            command: UNASKED,
            frames: 0,
            goal: None,
            until: FIRST_AT,
            way: Way::new(0.0, 0.0),
        }
    }

    /// Returns to rest before the tare, for the records.
    pub fn restart(&mut self) {
        self.finger.restart();
        self.finger.wall_mm = NEAR_MM;
        let Self { finger: _, frame, sense, command, frames, goal, until, way } = self;
        (*frame, *sense, *command) = (Frame::EMPTY, AT_REST, UNASKED);
        (*frames, *goal, *until, *way) = (0, None, FIRST_AT, Way::new(0.0, 0.0));
    }

    /// Inputs of the next step as a record, and the frame's time after it.
    pub fn record(&mut self, pipeline: &mut Pipeline) -> Record {
        let (frame, sense, command) = self.inputs();
        let record = Record { frame: *frame, sense: *sense, command: *command };
        pipeline.step(frame, sense, command);
        self.pass(pipeline.status(), pipeline.config().timing.frame_ns, CoreCycles(0));
        record
    }

    /// A digest of all that a pipeline makes of the records, from their beginning: the same on every machine.
    pub fn digest(&mut self, pipeline: &mut Pipeline) -> u32 {
        self.restart();
        let mut digest = Digest::new();
        for _ in 0..RECORDS {
            self.record(pipeline);
            digest.add(pipeline.status().duty, pipeline.status());
        }
        let value = digest.value();
        value as u32 ^ (value >> 32) as u32
    }

    /// Inputs of the next step.
    pub fn inputs(&self) -> (&Frame, &Sense, &Command) {
        (&self.frame, &self.sense, &self.command)
    }

    /// True if the last goal is over.
    pub fn done(&self) -> bool {
        self.goal == Some(GOALS.len())
    }

    /// Advances the finger by a frame time under the step's duty; `answer` is the time that the step took. Returns the
    /// step response of the force at the end of a goal.
    pub fn pass(&mut self, status: &Status, frame_ns: u32, answer: CoreCycles) -> Option<Answer> {
        self.finger.advance(status.bridge(), frame_ns);
        self.finger.fill(&mut self.frame);
        self.sense = self.finger.sense(answer);
        self.frames += 1;
        // The first frame is empty, which would end a tare.
        self.command.tare_request = 1;
        self.command.torque = self.frames >= TORQUE_AT;
        self.way.add(self.finger.force_n());
        if self.frames < self.until {
            return None;
        }
        let over = self.goal.filter(|goal| *goal < GOALS.len());
        let answered = over.map(|goal| self.way.answer(goal, frame_ns as f32 * 1e-6));
        let next = self.goal.map_or(0, |goal| (goal + 1).min(GOALS.len()));
        self.goal = Some(next);
        let (goal_mn, frames) = GOALS.get(next).copied().unwrap_or((0, u32::MAX / 2));
        self.command.goal = newtons(goal_mn);
        self.until = self.frames + frames;
        self.way = Way::new(self.finger.force_n(), goal_mn as f32 * 1e-3);
        answered
    }
}

impl Default for Bench {
    fn default() -> Self {
        Self::new()
    }
}
