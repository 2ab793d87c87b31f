//! A finger whose motions are recorded as on the board.

use crate::series::{Record, decode};
use fingertip::capture::{Capture, State as Kept};
use fingertip::measure::{Ended, Task};
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Config, ROWS, TARE_FRAMES};
use images::record::Record as Given;
use sim::native::bench::Bench;
use sim::setup::Setup;

pub struct Finger<const BYTES: usize = { 44 << 10 }> {
    pub bench: Bench,
    pub capture: Box<Capture<ROWS, COLUMNS, BYTES>>,
}

pub fn params() -> Params {
    Params { direction_confirmed: 1, ..Params::DEFAULT }
}

impl<const BYTES: usize> Finger<BYTES> {
    /// 5 mm from the wall, not tared.
    pub fn with(params: &Params) -> Self {
        let config = Config::shipped(params).expect("allowed");
        Self { bench: Bench::of(&Setup::default(), &config), capture: Box::new(Capture::NEW) }
    }

    /// Tared, torque off.
    pub fn tared() -> Self {
        let mut finger = Self::with(&params());
        finger.bench.command().tare_request += 1;
        (0..TARE_FRAMES + 2).for_each(|_| _ = finger.frame());
        finger
    }

    /// The motion in its first frame, with the torque that it needs.
    pub fn begun(task: Task) -> Self {
        let mut finger = Self::tared();
        finger.begin(task);
        finger
    }

    pub fn begin(&mut self, task: Task) {
        self.bench.command().torque = task == Task::Press;
        for _ in 0..3_000 {
            self.frame();
        }
        self.bench.request(task);
        let status = self.frame();
        assert_eq!(
            (status.measure.task, status.measure.state),
            (task, fingertip::measure::State::Running),
            "{status:?}"
        );
    }

    pub fn frame(&mut self) -> Status {
        self.frame_with(|_| {})
    }

    /// A frame as the board takes it, where somebody changes what the core is given.
    pub fn frame_with(&mut self, change: impl FnOnce(&mut Given)) -> Status {
        let Self { bench, capture } = self;
        let due = capture.is_due(bench.status(), &bench.record().command);
        if due {
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

    /// Steps until the motion ends; its last frame.
    pub fn ends(&mut self) -> Status {
        for _ in 0..400_000 {
            let status = self.frame();
            if status.measure.state != fingertip::measure::State::Running {
                return status;
            }
        }
        panic!("no end: {:?}", self.bench.status());
    }

    /// The record, which must be closed.
    pub fn record(&self) -> Record {
        assert_eq!(self.capture.standing().state, Kept::Done);
        decode(self.capture.data())
    }

    /// The motion ended so, and its record says so too.
    pub fn assert_ended(&self, task: Task, ended: Ended) {
        let measure = self.bench.status().measure;
        assert_eq!((measure.task, measure.ended), (task, ended), "{measure:?}");
        if task != Task::Jog {
            let record = self.record();
            assert_eq!((record.ended, record.value), (ended as u8, measure.value));
            assert_eq!(
                (record.kind, record.rows),
                (if task == Task::Press { 1 } else { 2 }, self.capture.standing().frames)
            );
        }
    }
}
