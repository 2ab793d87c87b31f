//! The native board: the same core on the host, closed over the world.
//!
//! A frame has [`SLOTS`] slots; each row is sampled at its own instant while the world moves on, and the duty that came
//! of a frame acts three slots after its end. Time is counted exactly, so a run is the same at any hour of the day.

pub mod bench;
#[cfg(feature = "calibrated")]
pub mod calibrated;
mod digest;
mod scan;
pub mod served;

pub use scan::Clock;
pub use scan::DUTY_DELAY_SLOTS;

use crate::bridge::Bridge;
use crate::effects::sensor::{Readout, Stages as _};
use crate::effects::set::{Named, Parts, Set};
use crate::host::Host;
use crate::host::grip::Reading;
use crate::ledger;
use crate::mechanics::body::Surroundings;
use crate::run::RunError;
use crate::scene::Scene;
use crate::scene::controller;
use crate::setup::Setup;
use crate::watch::{self, Controller, Cost, Step, Summary, Watch};
use crate::world::{World, WorldError};
use digest::Digest;
use fingertip::command::Command;
use fingertip::config::{ConfigError, newtons};
use fingertip::frame::Sense;
use fingertip::shipped::{Calibration, Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};
use fingertip::units::Celsius;
use std::time::Instant;

/// Why a scene does not run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    /// The controller refuses its parameters.
    #[error("[controller] {0}")]
    Controller(ConfigError),
    /// The world cannot be simulated.
    #[error(transparent)]
    World(#[from] WorldError),
}

/// [`simulate`] as a [`Run`](crate::run::Run).
pub fn board(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, RunError> {
    Ok(simulate(scene, watch)?)
}

/// Runs a scene with the effects that it names.
pub fn simulate(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, SimError> {
    simulate_with::<Named>(scene, watch)
}

/// The same with a set of effects: `()` has none compiled in, whatever the scene names.
pub fn simulate_with<E: Set>(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, SimError> {
    simulate_from::<E>(scene, Begun::default(), watch)
}

/// [`simulate`] with gains of the first finger's taxels, Q14.
pub fn simulate_calibrated(
    scene: &Scene,
    gains: &fingertip::shipped::Gains,
    watch: &mut dyn Watch,
) -> Result<Summary, SimError> {
    let mut board = Board::<Named>::new(scene, Begun::default())?;
    board.units[0].pipeline.calibrate(&Calibration::of(gains));
    board.calibration = Some(watch::Gains { gains_q14: *gains.rows(), masks: [0; ROWS] });
    board.whole(scene, Instant::now(), watch)
}

/// Where time stands when a run begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Begun {
    /// The board's clock; it changes nothing.
    pub clock_s: f64,
    /// The scene's time once the fingers are tared: what it holds before is left out.
    pub scene_s: f64,
}

/// The same with time begun elsewhere.
pub fn simulate_from<E: Set>(scene: &Scene, begun: Begun, watch: &mut dyn Watch) -> Result<Summary, SimError> {
    let started = Instant::now();
    Board::<E>::new(scene, begun)?.whole(scene, started, watch)
}

/// A finger's controller and what lies between it and the world.
struct Unit<E: Set> {
    pipeline: Pipeline,
    readout: Readout,
    sensor: E::Sensor,
    link: E::Link,
    host: Host,
    frame: Frame,
    command: Command,
    next: Bridge,
}

struct Board<E: Set> {
    world: World<E>,
    units: Vec<Unit<E>>,
    bridges: Vec<Bridge>,
    params: fingertip::params::Params,
    clock: Clock,
    /// The scene's start.
    start: Clock,
    begun: Begun,
    slot_s: f64,
    longest_s: f64,
    digest: Digest,
    /// True once the finger is tared: from then on the host sends.
    runs: bool,
    /// What the first finger was given beside its parameters.
    calibration: Option<watch::Gains>,
}

/// A temperature as the controller has it.
fn celsius(degrees: f64) -> Celsius {
    Celsius::from_bits((degrees * 65_536.0).floor() as i32)
}

impl<E: Set> Board<E> {
    fn new(scene: &Scene, begun: Begun) -> Result<Self, SimError> {
        let config = Config::shipped(&controller::params(scene)).map_err(SimError::Controller)?;
        let fingers = 0..scene.table("hand").whole("fingers") as usize;
        Self::of(scene, begun, &config, &controller::setup(scene), fingers.map(|finger| E::of(scene, finger)))
    }

    /// Of these parts, a finger for each.
    fn of(
        scene: &Scene,
        begun: Begun,
        config: &Config,
        setup: &Setup,
        fingers: impl Iterator<Item = Parts<E>>,
    ) -> Result<Self, SimError> {
        let (mut units, mut effects) = (Vec::new(), Vec::new());
        for (finger, parts) in fingers.enumerate() {
            effects.push((parts.drive, parts.contact));
            units.push(Unit {
                pipeline: Pipeline::new(config),
                readout: Readout::new(&setup.array).with_events(scene, finger),
                sensor: parts.sensor,
                link: parts.link,
                host: Host::new(scene),
                frame: Frame::EMPTY,
                command: Command::default(),
                next: Bridge::Coast,
            });
        }
        let world = World::<E>::new(setup, &Surroundings::of(scene), effects);
        let longest_s = scene.table("world").number("step_us") * 1e-6;
        world.check_step(longest_s)?;
        let slot_s = f64::from(config.timing.slot.0) / f64::from(fingertip::shipped::CLOCKS.timer_hz);
        let bridges = vec![Bridge::Coast; units.len()];
        Ok(Self {
            world,
            units,
            bridges,
            params: config.params,
            clock: Clock::from_start(begun.clock_s),
            start: Clock::default(),
            begun,
            slot_s,
            longest_s,
            digest: Digest::new(),
            runs: false,
            calibration: None,
        })
    }

    /// Tares and runs.
    fn whole(mut self, scene: &Scene, started: Instant, watch: &mut dyn Watch) -> Result<Summary, SimError> {
        self.tare(watch);
        let set_up_s = started.elapsed().as_secs_f64();
        self.run(scene, watch);
        Ok(Summary {
            virtual_s: self.time_s(),
            set_up_s,
            wall_s: started.elapsed().as_secs_f64() - set_up_s,
            ledger: self.costs(scene),
            digest: self.digest.hex(),
        })
    }

    fn tare(&mut self, watch: &mut dyn Watch) {
        let mut controllers = vec![Controller { params: self.params, calibration: None }; self.units.len()];
        controllers[0].calibration = self.calibration.take();
        watch.begin(&controllers);
        let tare_frames = TARE_FRAMES + 2;
        self.start = self.clock;
        self.start.go_on(f64::from(tare_frames) * self.slot_s * SLOTS as f64);
        self.start.go_back(self.begun.scene_s);
        for unit in &mut self.units {
            unit.command.tare_request = 1;
        }
        for _ in 0..tare_frames {
            self.frame(watch);
        }
        self.start = self.clock;
        self.start.go_back(self.begun.scene_s);
    }

    fn run(&mut self, scene: &Scene, watch: &mut dyn Watch) {
        self.runs = true;
        for unit in &mut self.units {
            unit.command.torque = true;
            unit.command.bus_watchdog_ms = scene.table("host").whole("watchdog_ms") as u16;
        }
        while self.time_s() < scene.duration_s {
            self.frame(watch);
        }
    }

    /// From the scene's start; below 0 while the fingers are tared.
    fn time_s(&self) -> f64 {
        self.clock.since(self.start)
    }

    /// Scans one frame of each finger and takes its control step.
    fn frame(&mut self, watch: &mut dyn Watch) {
        self.scan();
        for finger in 0..self.units.len() {
            self.control(finger, watch);
        }
    }

    /// What a finger's control step learns beside the frame.
    fn sense(&mut self, finger: usize, silent_ms: u16) -> Sense {
        let chip = self.units[finger].sensor.chip_c(self.time_s()).map(celsius);
        Sense { chip, ..self.world.sense(finger, silent_ms) }
    }

    fn control(&mut self, finger: usize, watch: &mut dyn Watch) {
        let time_s = self.time_s();
        let unit = &mut self.units[finger];
        unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
        let mut silent_ms = 0;
        if self.runs {
            let goal_n = unit.host.goal_n(time_s, &mut unit.link);
            unit.command.goal = newtons((goal_n * 1e3 + 0.5).floor() as i32);
            silent_ms = unit.host.silent_ms(time_s);
            while let Some(request) = unit.host.request(time_s) {
                request.apply(&mut unit.command);
            }
        }
        let sense = self.sense(finger, silent_ms);
        let unit = &mut self.units[finger];
        let (duty, status) = unit.pipeline.step(&unit.frame, &sense, &unit.command);
        unit.next = Bridge::of(status);
        if self.runs {
            unit.host.read(time_s, || Reading::of(status), &mut unit.link);
        }
        self.digest.add(&unit.frame, &sense, &unit.command, duty, status);
        let truth = self.world.truth(finger, watch.wants_pressures(finger, time_s));
        let (frame, sense, command, status) = (&unit.frame, &sense, &unit.command, &status);
        watch.step(&Step { finger, time_s, frame, sense, command, status, truth: &truth });
    }

    /// By effect in the scene's order, all fingers and stages together.
    fn costs(&self, scene: &Scene) -> Vec<Cost> {
        let mut all = Vec::new();
        for (unit, finger) in self.units.iter().zip(self.world.fingers()) {
            all.extend(E::costs(&unit.sensor, &finger.contact.effects, &finger.drive, &unit.link));
        }
        ledger::by_effect(scene, &all)
    }
}
