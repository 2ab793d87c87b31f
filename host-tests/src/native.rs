//! The same core on the host, closed over the plant: fast, and without a microcontroller in between.

use crate::plant::World;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{Config, Frame, Pipeline, SLOTS};
use images::record::Record;
use sim::bridge::Bridge;
use sim::native::DUTY_DELAY_SLOTS;
use sim::setup::Setup;

/// A board with the core running on it.
pub struct Native {
    /// The world around the controller.
    pub world: World,
    /// The controller.
    pub pipeline: Pipeline,
    /// What the host asks.
    pub command: Command,
    /// The last frame scanned.
    pub frame: Frame,
    /// What was sensed beside it.
    pub sense: Sense,
    slot_s: f64,
    frames: u64,
    bridge: Bridge,
    next: Bridge,
}

impl Native {
    /// At rest, the bridge off.
    pub fn new(setup: &Setup, config: &Config) -> Self {
        Self {
            world: World::new(setup),
            pipeline: Pipeline::new(config),
            command: Command::default(),
            frame: Frame::EMPTY,
            sense: Sense::default(),
            slot_s: f64::from(config.timing.frame().0) / f64::from(fingertip::shipped::CLOCKS.timer_hz) / SLOTS as f64,
            frames: 0,
            bridge: Bridge::Coast,
            next: Bridge::Coast,
        }
    }

    /// Virtual time, s.
    pub fn time_s(&self) -> f64 {
        self.frames as f64 * self.slot_s * SLOTS as f64
    }

    /// Scans one frame, row by row while the world moves on, and takes one control step.
    pub fn step(&mut self) -> Status {
        self.step_with(|_| {})
    }

    /// The same, where somebody changes what the core is given.
    pub fn step_with(&mut self, change: impl FnOnce(&mut Record)) -> Status {
        for slot in 0..SLOTS {
            if slot == DUTY_DELAY_SLOTS {
                self.bridge = self.next;
            }
            self.world.advance(self.slot_s, self.bridge);
            for (column, code) in self.world.slot_codes(slot).into_iter().enumerate() {
                self.frame.set_code(slot, column, code);
            }
        }
        self.frames += 1;
        self.frame.sequence = self.frames as u32;
        self.sense = self.world.sense(0);
        let mut record = Record { frame: self.frame, sense: self.sense, command: self.command };
        change(&mut record);
        let (_, status) = self.pipeline.step(&record.frame, &record.sense, &record.command);
        self.next = Bridge::of(status);
        *status
    }

    /// Tares, then enables torque with no goal.
    pub fn tare_and_enable(&mut self) {
        self.command.tare_request = self.command.tare_request.wrapping_add(1);
        for _ in 0..fingertip::shipped::TARE_FRAMES + 2 {
            self.step();
        }
        self.command.torque = true;
    }
}
