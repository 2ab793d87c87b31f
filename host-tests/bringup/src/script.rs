//! The finger on the chip: what is asked of it, as in the demonstration, how its force answers, and the finger itself.
//!
//! The finger is the reference one against a wall, in single precision: array, motor and wall of `docs/runs.md`, quick enough
//! to run beside the loop on the microcontroller. Simpler than the demonstration's plant: explicit steps of a sixth of a
//! frame, all rows of a frame read at its middle, the pressures interpolated from a table over the indentation.
//! `tests/judge.rs` holds the force steps against those of the demonstration.

use core::f32::consts::PI;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::contact::FitLevel;
use fingertip::frame::Sense;
use fingertip::pipeline::{Bridge, Status};
use fingertip::shipped::{COLUMNS, Frame, Pipeline, ROWS, TARE_FRAMES};
use fingertip::units::{CoreCycles, Duty, Newtons};
use images::record::{Digest, Record};

/// Goals in mN, and number of frames for which each is held; 0 releases. The first approach is 5 mm long.
pub const GOALS: [(i32, u32); 6] =
    [(1_000, 5_000), (200, 2_500), (2_000, 2_500), (5_000, 2_500), (1_000, 2_500), (0, 1_000)];
/// The goals among them that are steps from one force to another.
pub const STEPS: core::ops::Range<usize> = 1..5;
/// Frames from the start to torque on, longer than the tare.
const TORQUE_AT: u32 = TARE_FRAMES + 20;
const FIRST_AT: u32 = TORQUE_AT + 20;
/// Records that the step is studied on, with the wall so near: most of them in contact.
pub const RECORDS: u32 = 1_200;
const NEAR_MM: f32 = 1.0;
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
    /// Bench before the tare; [`Finger::make_table`] must be called.
    pub const fn at_rest() -> Self {
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

const RADIUS_MM: f32 = 10.0;
const MODULUS_KPA: f32 = 250.0;
/// pi Y, so that F = pi Y d^2, N/mm^2.
pub(crate) const FORCE_PER_MM2: f32 = PI * MODULUS_KPA * 1e-3;
const PITCH_MM: f32 = 1.5;
/// The virtual ground, the preload and the slope of a taxel, in codes.
const GROUND: f32 = 0.3 / 3.3 * 4_096.0;
const PRELOAD: f32 = 40.0;
const PER_KPA: f32 = 24.0;
/// R_on over K: share that a row loses per code of its sum.
const SAG_PER_CODE: f32 = 30.0 / 1.8e7;

const TORQUE_NM_PER_A: f32 = 5.35e-3;
const MOTOR_AND_BRIDGE_OHM: f32 = 2.83 + 0.7;
const INERTIA_KG_M2: f32 = 0.71e-7;
const FRICTION_NM: f32 = 0.12e-3;
/// Friction that a gear of 70 % adds, as a share of the load.
const FRICTION_SHARE: f32 = 1.0 / 0.7 - 1.0;
pub(crate) const MM_PER_RAD: f32 = 12.0 / 43.0;
const NM_PER_N: f32 = MM_PER_RAD * 1e-3;
pub(crate) const COUNTS_PER_RAD: f32 = 1_600.0 / (2.0 * PI);
const SOURCE_V: f32 = 6.0;
const SOURCE_OHM: f32 = 0.1;

/// Number of steps in a frame. After half of them the array is read and the new duty acts: 50 us after the frame's
/// begin, close to the demonstration's 43.
const STEPS_A_FRAME: usize = 6;
const HALF_OF_THEM: usize = STEPS_A_FRAME / 2;

/// Distances of a taxel's middle from the array's along an axis, in half pitches: 1, 3, .. 9.
const HALF: usize = COLUMNS / 2;
/// Taxels that mirror and swap of the axes do not make the same.
const CLASSES: usize = HALF * (HALF + 1) / 2;
/// Number of indentations in the table: 0 to 2.8 mm, more than 6 N need.
const DEPTHS: usize = 141;
const DEPTH_STEP_MM: f32 = 0.02;
/// Points along each side of a taxel whose mean is its pressure.
const POINTS: usize = 6;

pub struct Finger {
    kpa: [[f32; CLASSES]; DEPTHS],
    /// Travel at which the tip touches.
    pub wall_mm: f32,
    angle_rad: f32,
    speed_rad_per_s: f32,
    bridge: Bridge,
    supply_v: f32,
    read_mm: f32,
}

impl Finger {
    /// Finger at rest at a distance from the wall, the bridge open; [`Self::make_table`] must be called.
    pub const fn new(wall_mm: f32) -> Self {
        Self {
            kpa: [[0.0; CLASSES]; DEPTHS],
            wall_mm,
            angle_rad: 0.0,
            speed_rad_per_s: 0.0,
            bridge: Bridge::Open,
            supply_v: SOURCE_V,
            read_mm: 0.0,
        }
    }

    /// Returns to rest. Table and wall stay.
    pub fn restart(&mut self) {
        let Self { kpa: _, wall_mm: _, angle_rad, speed_rad_per_s, bridge, supply_v, read_mm } = self;
        (*angle_rad, *speed_rad_per_s, *bridge, *supply_v, *read_mm) = (0.0, 0.0, Bridge::Open, SOURCE_V, 0.0);
    }

    /// Makes the table: some ten million cycles.
    pub fn make_table(&mut self) {
        for (place, line) in self.kpa.iter_mut().enumerate() {
            let depth_mm = place as f32 * DEPTH_STEP_MM;
            let mut force_n = 0.0;
            for (along, across) in (0..HALF).flat_map(|along| (0..=along).map(move |across| (along, across))) {
                let kpa = mean_kpa(depth_mm, [along, across]);
                line[class(along, across)] = kpa;
                // Mirrored in both axes, and swapped where the axes differ.
                let alike = if along == across { 4.0 } else { 8.0 };
                force_n += alike * kpa * PITCH_MM * PITCH_MM * 1e-3;
            }
            // What the points miss at the rim.
            let scale = if force_n > 0.0 { FORCE_PER_MM2 * depth_mm * depth_mm / force_n } else { 0.0 };
            line.iter_mut().for_each(|kpa| *kpa *= scale);
        }
    }

    /// The true contact force.
    pub fn force_n(&self) -> f32 {
        let depth_mm = self.depth_mm();
        FORCE_PER_MM2 * depth_mm * depth_mm
    }

    pub fn travel_mm(&self) -> f32 {
        self.angle_rad * MM_PER_RAD
    }

    fn depth_mm(&self) -> f32 {
        (self.travel_mm() - self.wall_mm).max(0.0)
    }

    /// A frame's time passes: for its first part under the bridge as it was, then under the new one.
    pub fn advance(&mut self, bridge: Bridge, frame_ns: u32) {
        let step_s = frame_ns as f32 * 1e-9 / STEPS_A_FRAME as f32;
        for step in 0..STEPS_A_FRAME {
            if step == HALF_OF_THEM {
                self.bridge = bridge;
                self.read_mm = self.depth_mm();
            }
            self.step(step_s);
        }
    }

    fn step(&mut self, step_s: f32) {
        let load_nm = NM_PER_N * self.force_n();
        let friction_nm = FRICTION_NM + FRICTION_SHARE * load_nm;
        let gain = step_s / INERTIA_KG_M2;
        // A coasting motor has no current; else the winding brakes as it turns.
        let (drive_nm, slowing) = match duty(self.bridge) {
            None => {
                self.supply_v = SOURCE_V;
                (0.0, 1.0)
            }
            Some(duty) => {
                let ohms = MOTOR_AND_BRIDGE_OHM + duty * duty * SOURCE_OHM;
                let back_emf_v = TORQUE_NM_PER_A * self.speed_rad_per_s;
                self.supply_v = SOURCE_V - SOURCE_OHM * duty * (duty * SOURCE_V - back_emf_v) / ohms;
                let per_ohm = TORQUE_NM_PER_A / ohms;
                (per_ohm * duty * SOURCE_V, 1.0 + gain * TORQUE_NM_PER_A * per_ohm)
            }
        };
        let net_nm = drive_nm - load_nm;
        let before = self.speed_rad_per_s;
        let direction = if before != 0.0 {
            before.signum()
        } else if net_nm.abs() > friction_nm {
            net_nm.signum()
        } else {
            return;
        };
        let after = (before + gain * (net_nm - direction * friction_nm)) / slowing;
        // It rests before it turns back.
        self.speed_rad_per_s = if after * direction > 0.0 { after } else { 0.0 };
        self.angle_rad += 0.5 * step_s * (before + self.speed_rad_per_s);
    }

    /// Inputs of the step other than the frame.
    pub fn sense(&self, answer: CoreCycles) -> Sense {
        let counts = self.angle_rad * COUNTS_PER_RAD;
        // Rounded down, which the cast does for positive numbers only.
        let whole = counts as i32;
        let encoder = if counts < whole as f32 { whole - 1 } else { whole };
        Sense { encoder, supply_mv: (self.supply_v * 1e3) as u16, answer, ..AT_REST }
    }

    /// The codes of the frame that has just ended.
    pub fn fill(&self, frame: &mut Frame) {
        let place = self.read_mm / DEPTH_STEP_MM;
        let low = (place as usize).min(DEPTHS - 2);
        let part = (place - low as f32).min(1.0);
        let (below, above) = (&self.kpa[low], &self.kpa[low + 1]);
        let mut loaded = [0.0; CLASSES];
        for ((code, below), above) in loaded.iter_mut().zip(below).zip(above) {
            *code = PRELOAD + PER_KPA * (below + part * (above - below));
        }
        for along in 0..HALF {
            let codes: [f32; HALF] = core::array::from_fn(|across| loaded[class(along.max(across), along.min(across))]);
            let share = 1.0 / (1.0 + SAG_PER_CODE * 2.0 * codes.iter().sum::<f32>());
            for (across, code) in codes.into_iter().enumerate() {
                let code = ((GROUND + share * code) as u16).min(4_095);
                frame.set_code(HALF + along, HALF - 1 - across, code);
                frame.set_code(HALF + along, HALF + across, code);
            }
            // The other half of the array mirrors this one.
            if let Some(row) = frame.codes.slot(HALF + along).copied()
                && let Some(mirrored) = frame.codes.slot_mut(HALF - 1 - along)
            {
                *mirrored = row;
            }
        }
        if let Some(undriven) = frame.codes.slot_mut(ROWS) {
            undriven.fill(GROUND as u16);
        }
        frame.sequence = frame.sequence.wrapping_add(1);
    }
}

/// The share of the supply at the motor; `None` while it coasts.
fn duty(bridge: Bridge) -> Option<f32> {
    match bridge {
        Bridge::Asleep | Bridge::Open => None,
        Bridge::Brakes => Some(0.0),
        Bridge::Driven(duty) => Some(f32::from(duty.0) / f32::from(Duty::FULL)),
    }
}

/// The place of a taxel in a line of the table, the larger distance first.
const fn class(along: usize, across: usize) -> usize {
    along * (along + 1) / 2 + across
}

/// Mean pressure on a taxel: p(r) = Y (r_c^2 - r^2) / (L (L + a - d)), L = sqrt(a^2 - r^2).
fn mean_kpa(depth_mm: f32, taxel: [usize; 2]) -> f32 {
    let rim2 = depth_mm * (2.0 * RADIUS_MM - depth_mm);
    let places = taxel.map(|place| {
        core::array::from_fn::<_, POINTS, _>(|point| (place as f32 + (point as f32 + 0.5) / POINTS as f32) * PITCH_MM)
    });
    let mut sum = 0.0;
    for (x, y) in places[0].into_iter().flat_map(|x| places[1].map(|y| (x, y))) {
        let r2 = x * x + y * y;
        if r2 < rim2 {
            let length = libm::sqrtf(RADIUS_MM * RADIUS_MM - r2);
            sum += MODULUS_KPA * (rim2 - r2) / (length * (length + RADIUS_MM - depth_mm));
        }
    }
    sum / (POINTS * POINTS) as f32
}
