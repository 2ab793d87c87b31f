//! A finger that is captured from its tare on.

use fingertip::capture::{Capture, Ended, State};
use fingertip::config::newtons;
use fingertip::pressure::GAIN_ONE;
use fingertip::shipped::{COLUMNS, Calibration, Gains, ROWS, TAXELS};
use host_tests::finger::config;
use images::record::Record;
use sim::native::bench::Bench;
use sim::setup::Setup;

pub type Burst<const BYTES: usize> = Capture<ROWS, COLUMNS, BYTES>;

pub struct Finger<const BYTES: usize> {
    pub native: Bench,
    pub capture: Box<Burst<BYTES>>,
}

impl<const BYTES: usize> Finger<BYTES> {
    /// 0.4 mm from the wall, with gains that differ.
    pub fn new() -> Self {
        let config = config();
        let mut setup = Setup::default();
        setup.wall.distance_mm = 0.4;
        let mut native = Bench::of(&setup, &config);
        native.pipeline().calibrate(&Calibration::of(&gains()));
        Self { native, capture: Box::new(Burst::NEW) }
    }

    /// A frame, as a board takes it.
    pub fn frame(&mut self) {
        self.frame_with(|_| {});
    }

    /// The same, where somebody changes what the core is given.
    pub fn frame_with(&mut self, change: impl FnOnce(&mut Record)) {
        let Self { native, capture } = self;
        if capture.is_due(native.status(), &native.record().command) {
            capture.begin(native.pipeline());
        }
        let mut given = native.record();
        native.step_with(|record| {
            change(record);
            given = *record;
        });
        capture.record(&given.frame, &given.sense, &given.command, native.status());
    }

    /// Arms, tares, touches and holds until the memory is full.
    pub fn press(&mut self) {
        self.capture.arm();
        self.native.command().tare_request += 1;
        self.frame();
        self.native.command().torque = true;
        self.native.command().goal = newtons(800);
        self.until_done();
    }

    pub fn until_done(&mut self) {
        while self.capture.standing().state == State::Recording {
            self.frame();
        }
        assert_eq!(self.capture.standing().ended, Ended::Full);
    }

    /// A press of a fresh finger.
    pub fn pressed() -> Self {
        let mut finger = Self::new();
        finger.press();
        finger
    }
}

/// Of all sizes.
pub fn gains() -> Gains {
    let mut gains = Gains::ONE;
    for place in 0..TAXELS {
        assert!(gains.set(place, GAIN_ONE - 1_000 + 20 * place as u16));
    }
    gains
}
