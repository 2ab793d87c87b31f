//! The motions: a jog each way, then strokes to and fro under steps of voltage, each bounded in duty, time and travel.
//!
//! ```text
//! jog forward - rest - jog back - rest - [ stroke - rest ] 15 times - home - rest
//! ```
//!
//! Voltage is given, not closed over the encoder. A stroke ends where the shorted motor will roll out within the way;
//! whatever else happens shorts the motor at once, waits until it rests, and ends in a refusal.

mod motion;

use super::estimate::Estimate;
use super::line::Line;
use super::strokes::{COUNT, COUNT_FROM, kind};
use super::{Commissioning, Refusal, Task};
use crate::config::Config;
use crate::config::motions::Motions;
use crate::units::Newtons;

/// What a jog must make of counts.
const PROVEN: i32 = 4;
/// No stroke takes more than this part of the supply.
const STROKE_PART: i32 = 3;
/// A trial is so many times slower than a slow stroke.
const TRIAL: i32 = 2;

/// What a frame says.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The encoder's count.
    pub encoder: i32,
    /// The array's force.
    pub force: Newtons,
    /// The bridge's supply.
    pub supply_mv: u16,
    /// Whether the voltage asked for is not what was let through.
    pub held_back: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Idle,
    Jog,
    Stroke,
    /// Shorted until it rests; then on, or to the refusal.
    Rest(Option<Refusal>),
}

/// A commissioning.
#[derive(Clone, Debug)]
pub struct Run {
    phase: Phase,
    outcome: Commissioning,
    task: Task,
    plan: Motions,
    /// Jogs and strokes done.
    done: u8,
    forward: bool,
    /// Counts where it all began, and where this motion did.
    origin: i32,
    begun: i32,
    /// Frames of this motion, or of this rest.
    frames: u32,
    /// What is asked for.
    voltage_mv: i32,
    /// Voltages that the strokes back and forward have for friction: first those at which the jogs began to move. How
    /// far each jog went.
    common_mv: [i32; 2],
    jogged: [i32; 2],
    line: Line,
    /// Where this motion was shorted, and how far the last slow stroke forward rolled on from there.
    braked: i32,
    rolled: i32,
    /// The last look at the speed: where and when, and the fastest.
    looked: (i32, u32),
    fastest: i32,
    /// Counts over the last span.
    gone: i32,
    /// The count that stood last, and since which frame.
    stood: (i32, u32),
    estimate: Estimate,
}

impl Run {
    /// Nothing asked for.
    pub const fn new() -> Self {
        Self {
            phase: Phase::Idle,
            outcome: Commissioning::None,
            task: Task::Stop,
            plan: Motions::NONE,
            done: 0,
            forward: true,
            origin: 0,
            begun: 0,
            frames: 0,
            voltage_mv: 0,
            common_mv: [0; 2],
            jogged: [0; 2],
            line: Line::NONE,
            braked: 0,
            rolled: 0,
            looked: (0, 0),
            fastest: 0,
            gone: 0,
            stood: (0, 0),
            estimate: Estimate::NONE,
        }
    }

    /// Begins a commissioning, at rest at this count.
    pub fn begun(task: Task, encoder: i32, config: &Config) -> Self {
        Self {
            phase: Phase::Jog,
            outcome: Commissioning::Running(0),
            task,
            plan: config.motions,
            origin: encoder,
            begun: encoder,
            ..Self::new()
        }
    }

    /// Whether it still needs the motor.
    pub fn running(&self) -> bool {
        self.phase != Phase::Idle
    }

    /// How it stands.
    pub fn outcome(&self) -> Commissioning {
        self.outcome
    }

    /// Shorts the motor until it rests, and ends without a result.
    pub fn halt(&mut self, encoder: i32) {
        if !matches!(self.phase, Phase::Idle | Phase::Rest(Some(_))) {
            self.brake(Some(Refusal::Interrupted), encoder);
        }
    }

    /// Ends without a result, at once.
    pub fn refuse(&mut self, refusal: Refusal) {
        self.phase = Phase::Idle;
        self.voltage_mv = 0;
        self.outcome = Commissioning::Refused(refusal);
    }

    /// What the motor is to get.
    pub fn voltage_mv(&self) -> i32 {
        self.voltage_mv
    }

    /// Takes a frame.
    #[inline(never)]
    pub fn observe(&mut self, view: &View, config: &Config) {
        self.frames = self.frames.saturating_add(1);
        match self.phase {
            Phase::Idle => {}
            Phase::Rest(refusal) => self.rest(refusal, view, config),
            Phase::Jog | Phase::Stroke => {
                if let Some(refusal) = self.danger(view) {
                    self.brake(Some(refusal), view.encoder);
                } else if self.phase == Phase::Jog {
                    self.jog(view);
                } else {
                    self.stroke(view);
                }
            }
        }
    }

    /// Shorts the motor.
    fn brake(&mut self, refusal: Option<Refusal>, encoder: i32) {
        self.voltage_mv = 0;
        self.phase = Phase::Rest(refusal);
        self.frames = 0;
        self.braked = encoder;
        self.stood = (encoder, 0);
    }

    fn rest(&mut self, refusal: Option<Refusal>, view: &View, config: &Config) {
        let (count, since) = self.stood;
        if view.encoder != count {
            self.stood = (view.encoder, self.frames);
        } else if self.frames.wrapping_sub(since) >= self.plan.still {
            return match refusal {
                Some(refusal) => self.refuse(refusal),
                None => self.next(view, config),
            };
        }
        if view.force >= self.plan.touch && refusal.is_none() {
            self.phase = Phase::Rest(Some(Refusal::Touched));
        }
        if self.frames >= self.plan.rest {
            self.refuse(refusal.unwrap_or(Refusal::Restless));
        }
    }

    /// The next motion, or the end.
    fn next(&mut self, view: &View, config: &Config) {
        if self.slow_forward() {
            self.rolled = view.encoder.wrapping_sub(self.braked);
        }
        self.done = self.done.saturating_add(1);
        self.frames = 0;
        self.begun = view.encoder;
        self.line = Line::NONE;
        self.looked = (0, 0);
        self.fastest = 0;
        if self.done == 1 {
            self.forward = false;
            self.phase = Phase::Jog;
            return;
        }
        if self.done == 2
            && let Some(refusal) = self.direction()
        {
            return self.refuse(refusal);
        }
        if self.task != Task::Measure {
            return self.end(Commissioning::Directed);
        }
        let stroke = self.done - 2;
        if stroke > COUNT {
            return match self.estimate.drive(self.plan.beyond_mv, self.common_mv, config) {
                Ok(drive) => self.end(Commissioning::Measured(drive)),
                Err(refusal) => self.refuse(refusal),
            };
        }
        let (forward, fast) = kind(stroke);
        if stroke == COUNT_FROM {
            self.plan = self.plan.slower(self.estimate.slowest());
        }
        self.forward = forward;
        let beyond = self.plan.beyond_mv[usize::from(fast)];
        let beyond = if stroke < COUNT_FROM { beyond / TRIAL } else { beyond };
        let voltage = self.common_mv[usize::from(forward)] + beyond;
        let limit = (i32::from(view.supply_mv) / STROKE_PART).min(config.params.voltage_max_mv);
        if voltage > limit {
            return self.refuse(Refusal::HeldBack);
        }
        self.voltage_mv = if forward { voltage } else { -voltage };
        self.phase = Phase::Stroke;
        self.outcome = Commissioning::Running((u32::from(self.done) * 100 / (u32::from(COUNT) + 3)) as u8);
    }

    /// Whether the stroke that just came to rest was one whose roll the way home goes by.
    fn slow_forward(&self) -> bool {
        self.done >= 2 + COUNT_FROM && kind(self.done - 2) == (true, false)
    }

    fn end(&mut self, outcome: Commissioning) {
        self.phase = Phase::Idle;
        self.voltage_mv = 0;
        self.outcome = outcome;
    }

    /// What the jogs say against the direction.
    fn direction(&self) -> Option<Refusal> {
        let [back, forward] = self.jogged;
        if back >= PROVEN && forward >= PROVEN {
            None
        } else if back <= -PROVEN && forward <= -PROVEN {
            Some(Refusal::Reversed)
        } else if back.saturating_abs() < PROVEN || forward.saturating_abs() < PROVEN {
            Some(Refusal::Still)
        } else {
            Some(Refusal::Astray)
        }
    }
}

impl Default for Run {
    fn default() -> Self {
        Self::new()
    }
}
