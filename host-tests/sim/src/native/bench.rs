//! Finger on a bench, frame by frame, under the command of a test. The inputs of its controller can be changed, and the
//! scene around it can be exchanged while its controller stays, as a user moves finger and plate between two presses.
//! Its finger can also be broken and moved.

use crate::mechanics::{Bridge, Finger};
use crate::native::{Board, SimError, Unit};
use crate::plant::{self, Faults};
use crate::scene::{Scene, read};
use crate::setup::Setup;
use crate::watch::Truth;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::measure::{MeasureState, MeasureStatus, Task};
use fingertip::pipeline::Status;
use fingertip::shipped::{Capture, Config, Frame, Pipeline, TARE_FRAMES};
use images::record::Record;

/// First finger of a scene, or the finger of the plant.
pub struct Bench {
    board: Board,
    sense: Sense,
    capture: Box<Capture>,
}

/// Frames within which every measuring motion ends: 30 s.
const MEASURE_FRAMES: usize = 300_000;
/// Time between two frames of a rest.
const REST_STEP_S: f64 = 0.02;

impl Bench {
    /// Creates the bench at rest, torque off, not tared.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        Ok(Self::around(Board::new(&scene.without_events())?))
    }

    /// Replaces the world around the finger. Controller, tip and array keep the memory of their effects.
    pub fn exchange(&mut self, scene: &Scene) -> Result<(), SimError> {
        let mut before = core::mem::replace(&mut self.board, Board::new(&scene.without_events())?);
        let now = &mut self.board;
        (now.clock, now.bridges) = (before.clock, before.bridges);
        let finger = &mut now.world.fingers[0];
        let finger_before = &mut before.world.fingers[0];
        (finger.now, finger.faults) = (finger_before.now, finger_before.faults);
        finger.contact.effects.memory = core::mem::take(&mut finger_before.contact.effects.memory);
        if let (Some(now), Some(before)) = (now.units.first_mut(), before.units.into_iter().next()) {
            (now.pipeline, now.frame, now.command) = (before.pipeline, before.frame, before.command);
            (now.sensor, now.next, now.repeats) = (before.sensor, before.next, before.repeats);
            now.readout.faults = before.readout.faults;
        }
        Ok(())
    }

    /// Copies the bench of `scene`. Effects with a memory (noise, hysteresis, creep) start again in the copy.
    pub fn fork(&self, scene: &Scene) -> Result<Self, SimError> {
        let mut fork = Self::new(scene)?;
        let (from, to) = (&self.board, &mut fork.board);
        let (finger, finger_before) = (&mut to.world.fingers[0], &from.world.fingers[0]);
        finger.now = finger_before.now;
        finger.setup.wall.distance_mm = finger_before.setup.wall.distance_mm;
        let (before, now) = (&from.units[0], &mut to.units[0]);
        now.pipeline = before.pipeline.clone();
        (now.frame, now.command, now.next) = (before.frame, before.command, before.next);
        to.bridges.clone_from(&from.bridges);
        to.clock = from.clock;
        fork.sense = self.sense;
        Ok(fork)
    }

    fn around(board: Board) -> Self {
        Self { board, sense: Sense::default(), capture: Box::new(Capture::NEW) }
    }

    fn unit(&self) -> &Unit {
        &self.board.units[0]
    }

    fn finger_mut(&mut self) -> &mut Finger {
        &mut self.board.world.fingers[0]
    }

    pub fn command(&mut self) -> &mut Command {
        &mut self.board.units[0].command
    }

    pub fn pipeline(&mut self) -> &mut Pipeline {
        &mut self.board.units[0].pipeline
    }

    pub fn status(&self) -> &Status {
        self.unit().pipeline.status()
    }

    pub fn record(&self) -> Record {
        Record { frame: self.unit().frame, sense: self.sense, command: self.unit().command }
    }

    pub fn frame(&self) -> &Frame {
        &self.unit().frame
    }

    /// Scans one frame, row by row while the world moves on, and takes one control step.
    pub fn step(&mut self) -> Status {
        self.step_with(|_| {})
    }

    /// Steps as [`Bench::step`], with a change to the inputs of the controller.
    pub fn step_with(&mut self, change: impl FnOnce(&mut Record)) -> Status {
        self.board.scan();
        self.sense = self.board.sense(0, 0);
        let unit = &mut self.board.units[0];
        unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
        let mut record = self.record();
        change(&mut record);
        let unit = &mut self.board.units[0];
        let (_, status) = unit.pipeline.step(&record.frame, &record.sense, &record.command);
        unit.next = Bridge::of(status);
        self.capture.follow(&unit.pipeline);
        *self.status()
    }

    /// Steps for a time. Returns the largest true force, N.
    pub fn run(&mut self, seconds: f64) -> f64 {
        self.run_with(seconds, |_| {})
    }

    /// Steps as [`Bench::run`], with a change to the inputs of the controller.
    pub fn run_with(&mut self, seconds: f64, change: impl Fn(&mut Record)) -> f64 {
        let until_s = self.time_s() + seconds;
        let mut largest_n: f64 = 0.0;
        while self.time_s() < until_s {
            self.step_with(&change);
            largest_n = largest_n.max(self.truth().force_n);
        }
        largest_n
    }

    /// Lets time pass over a finger that touches nothing, with few frames. Torque must be off.
    pub fn rest(&mut self, seconds: f64) {
        for _ in 0..(seconds / REST_STEP_S).ceil() as usize {
            self.finger_mut().contact.effects.memory.each(|part| part.relax(REST_STEP_S, None));
            self.board.clock.go_on(REST_STEP_S);
            self.step();
        }
    }

    /// Makes a measuring motion and calls `each` after every frame. Returns how the motion ended.
    pub fn measure(&mut self, task: Task, mut each: impl FnMut(&mut Self)) -> MeasureStatus {
        self.request(task);
        let request = self.command().measure_request;
        for _ in 0..MEASURE_FRAMES {
            let Status { taken, measure, .. } = self.step();
            each(self);
            if taken.measure == request && measure.state != MeasureState::Running {
                return measure;
            }
        }
        panic!("{task:?} does not end: {:?}", self.status().measure);
    }

    /// Record of the last measuring motion, as it is read over the bus.
    pub fn kept(&self) -> &[u8] {
        self.capture.data()
    }

    /// Requests a measuring motion, or its end.
    pub fn request(&mut self, task: Task) {
        let command = self.command();
        command.measure_request = task.after(command.measure_request);
    }

    /// Tares: torque off, a tare, torque on. Nothing may touch.
    pub fn tare(&mut self) {
        let command = self.command();
        command.torque = false;
        command.tare_request = command.tare_request.wrapping_add(1);
        for _ in 0..TARE_FRAMES + 2 {
            self.step();
        }
        self.command().torque = true;
    }

    pub fn time_s(&self) -> f64 {
        self.board.time_s()
    }

    pub fn truth(&mut self) -> Truth {
        self.board.world.truth(0, false)
    }

    pub fn place(&mut self, travel_mm: f64) {
        self.finger_mut().place(travel_mm);
    }

    /// Puts the object where the tip meets it at this travel.
    pub fn place_object(&mut self, distance_mm: f64) {
        self.finger_mut().setup.wall.distance_mm = distance_mm;
    }

    /// Moves the surface of the object at a constant speed and calls `each` after every frame.
    pub fn carry_object(&mut self, from_mm: f64, to_mm: f64, mm_per_s: f64, mut each: impl FnMut(&mut Self)) {
        let (begun_s, duration_s) = (self.time_s(), (to_mm - from_mm).abs() / mm_per_s);
        while self.time_s() < begun_s + duration_s {
            let share = (self.time_s() - begun_s) / duration_s;
            self.place_object(from_mm + share * (to_mm - from_mm));
            self.step();
            each(self);
        }
        self.place_object(to_mm);
    }
}

impl Default for Bench {
    fn default() -> Self {
        Self::of(&Setup::default(), &Config::shipped(&images::CONFIRMED).expect("the defaults are allowed"))
    }
}

/// Step of the plant: once a slot.
const SCENE: &str = "about = \"the plant\"\nduration_s = 1.0\n[world]\nstep_us = 10.0\n";

impl Bench {
    /// Creates the finger of the plant under a controller: at rest, torque off, not tared.
    pub fn of(setup: &Setup, config: &Config) -> Self {
        let scene = read("plant", SCENE).expect("the plant's scene is one");
        let parts = core::iter::once(plant::parts(setup));
        let board = Board::of(&scene, config, setup, parts);
        let mut bench = Self::around(board.unwrap_or_else(|error| panic!("{error}")));
        // The scene does not name the effects of the plant.
        bench.board.units[0].repeats = false;
        bench
    }

    /// Sets or clears defects.
    pub fn harm(&mut self, change: impl FnOnce(&mut Faults)) {
        let faults = &mut self.board.world.fingers[0].faults;
        change(faults);
        let unit = &mut self.board.units[0];
        unit.readout.faults = Some(faults.array);
        unit.repeats = false;
    }
}
