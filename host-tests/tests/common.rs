//! Names and helpers of most tests.

pub use fastrand::Rng;
pub use fingertip::capture::{Capture, CaptureState};
pub use fingertip::command::Command;
pub use fingertip::config::newtons;
pub use fingertip::contact::{Contact, FitLevel, from_sums};
pub use fingertip::control::SpeedLoop;
pub use fingertip::frame::Sense;
pub use fingertip::measure::{Ended, MeasureState, MeasureStatus, Task};
pub use fingertip::params::Params;
pub use fingertip::pipeline::{Bridge, Status, Taring};
pub use fingertip::pressure::{GAIN_MAX, GAIN_ONE, TARE_BITS};
pub use fingertip::scan::Clocks;
pub use fingertip::shipped::{
    Array, CAPTURE_BYTES, CLOCKS, COLUMNS, Calibration, Config, Fit, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES, TAXELS,
    TactileImage, address,
};
pub use fingertip::state::{Fault, Limits, Mode};
pub use fingertip::units::{
    Celsius, CoreCycles, Duty, Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons,
};
pub use host_tests::fit_cases::{Noise, Object, Reading, Scene, Steps};
pub use host_tests::stimulus::{config, tared};
pub use images::record::Record;
pub use proptest::prelude::*;
pub use proptest::test_runner::TestRunner;
pub use sim::mechanics::pressures::Cell;
pub use sim::native::bench::Bench;
pub use sim::plant::{Plant, Taxel};
pub use sim::setup::Setup;
pub use std::collections::BTreeSet;
pub use std::ops::Range;

use proptest::test_runner::RngSeed;
use sim::scene::read;

/// Cases of a property, the same ones in every run.
pub fn seeded(cases: u32, seed: u64) -> ProptestConfig {
    ProptestConfig { cases, rng_seed: RngSeed::Fixed(seed), failure_persistence: None, ..ProptestConfig::default() }
}

pub fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| (row, column)))
}

/// Replaces the code of every taxel. The codes with no row driven stay.
pub fn recode(frame: &mut Frame, mut code: impl FnMut(usize, usize, u16) -> u16) {
    for (row, column) in places() {
        frame.set_code(row, column, code(row, column, frame.code(row, column)));
    }
}

/// Draw with mean 0 and deviation 1: the sum of twelve uniform ones.
pub fn normal(rng: &mut Rng) -> f64 {
    (0..12).map(|_| rng.f64()).sum::<f64>() - 6.0
}

/// Configuration that allowed parameters make.
pub fn allowed(params: Params) -> Config {
    Config::shipped(&params).expect("allowed")
}

pub fn frame_s(config: &Config) -> f64 {
    f64::from(config.timing.frame_ns) * 1e-9
}

/// The reference finger, tared, with torque on and no goal.
pub fn ready() -> Bench {
    let mut board = Bench::default();
    board.tare();
    board
}

/// The reference finger, half a second after this goal.
pub fn holding(goal_mn: i32) -> Bench {
    let mut board = ready();
    board.command().goal = newtons(goal_mn);
    board.frames(5_000);
    assert_eq!(board.step().mode, Mode::Force);
    board
}

/// Several frames of a bench.
pub trait InFrames {
    /// Runs `count` frames. Returns the status after the last one.
    fn frames(&mut self, count: u32) -> Status;

    /// Sets a goal and steps for a time. Returns the largest true force, N.
    fn hold(&mut self, goal_mn: i32, seconds: f64) -> f64;
}

impl InFrames for Bench {
    fn frames(&mut self, count: u32) -> Status {
        (0..count).for_each(|_| _ = self.step());
        *self.status()
    }

    fn hold(&mut self, goal_mn: i32, seconds: f64) -> f64 {
        self.command().goal = newtons(goal_mn);
        self.run(seconds)
    }
}

/// Contact after a number of frames with the same image.
pub fn read_often(fit: &mut Fit, picture: &TactileImage, frames: usize, config: &Config) -> Contact {
    (0..frames).map(|_| fit.read(picture, config)).last().unwrap_or_default()
}

/// A finger whose frames and motions are recorded as on the board.
pub struct Recorded<const BYTES: usize = CAPTURE_BYTES> {
    pub bench: Bench,
    pub capture: Box<Capture<ROWS, COLUMNS, BYTES>>,
}

impl<const BYTES: usize> Recorded<BYTES> {
    pub fn of(setup: &Setup, config: &Config) -> Self {
        Self { bench: Bench::of(setup, config), capture: Box::new(Capture::NEW) }
    }

    pub fn frame(&mut self) -> Status {
        self.frame_with(|_| {})
    }

    pub fn frames(&mut self, count: u32) {
        (0..count).for_each(|_| _ = self.frame());
    }

    /// Steps a frame whose inputs to the core are changed.
    pub fn frame_with(&mut self, change: impl FnOnce(&mut Record)) -> Status {
        let Self { bench, capture } = self;
        let command = bench.record().command;
        if capture.is_due(bench.pipeline(), &command) {
            capture.begin(bench.pipeline());
        }
        let mut given = bench.record();
        let status = bench.step_with(|record| {
            change(record);
            given = *record;
        });
        capture.record(&given.frame, &given.sense, &given.command, &status);
        capture.follow(bench.pipeline());
        status
    }
}

pub fn drives(mode: Mode) -> bool {
    !matches!(mode, Mode::Off | Mode::Tare | Mode::Fault)
}

/// State of a finger, for a failed assertion.
pub fn told(board: &mut Bench) -> String {
    let (truth, status) = (board.truth(), *board.status());
    format!(
        "{:?} {:?}, true {:.3} N at {:.3} mm, read {:.3} N with doubt {}, limits {:014b}",
        status.mode,
        status.fault,
        truth.force_n,
        truth.travel_mm,
        status.contact.force.0.to_num::<f64>(),
        status.contact.doubt,
        status.limits.0
    )
}

/// Scene of an object 5 mm away, off the array's middle by this, with these effects.
pub fn scene(seed: u64, centre_x_mm: f64, effects: &str) -> sim::scene::Scene {
    let text = format!(
        "about = \"a finger\"\nseed = {seed}\nduration_s = 1.0\n[object]\ndistance_mm = 5.0\n\
        centre_x_mm = {centre_x_mm:?}\n{effects}[[script]]\nat_s = 0.0\ngoal_n = 0.0\n"
    );
    read("t.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

/// Finger with noise, friction and uneven gains, and with this hysteresis and creep, tared.
pub fn ordinary(seed: u64, centre_x_mm: f64, width_percent: u32, rate_percent_per_decade: u32) -> Bench {
    let effects = format!(
        "[effects.noise]\nrms_codes = 1.5\n[effects.dry_friction]\ntorque_mnm = 0.15\n[effects.hysteresis]\n\
        width_percent = {width_percent}\n[effects.creep]\nrate_percent_per_decade = {rate_percent_per_decade}\n\
        [effects.gain_spread]\nrms_percent = 6\n"
    );
    let mut board = Bench::new(&scene(seed, centre_x_mm, &effects)).expect("a finger");
    board.tare();
    board
}

/// Tactile image of a contact with this spread of the gains, and the number of taxels that see it.
pub fn seen(scene: &Scene, spread: f64, bad: [u32; ROWS], rng: &mut Rng) -> (TactileImage, usize) {
    let noise = if spread > 0.0 { Noise::OfReading(spread) } else { Noise::None };
    Reading { steps: Steps::Sixteenths, noise, dead: 0 }.picture(&scene.pressures(), bad, rng)
}

/// The same without noise.
pub fn still(scene: &Scene, bad: [u32; ROWS]) -> (TactileImage, usize) {
    seen(scene, 0.0, bad, &mut Rng::with_seed(0))
}

/// A hemisphere on a plane.
pub fn plane(pitch_mm: f64, d_mm: f64, x_mm: f64, y_mm: f64) -> Scene {
    Scene { pitch_mm, d_mm, x_mm, y_mm, object: Object::Plane }
}
