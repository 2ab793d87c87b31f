//! The control task: a turn at half of each frame and one at its end, on an executor that only the guard, the scan and
//! the bus interrupt.
//!
//! Nothing here waits, allocates, logs or holds a lock for longer than a copy of a snapshot.
//! A capture's start, a new configuration, new gains and a save take longer than a frame: the scan stops for them and
//! starts again.

use fingertip::capture::Ended;
use fingertip::command::Command;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::pipeline::Bridge as Requested;
use fingertip::shipped::{Calibration, Config, Frame, Pipeline};
use fingertip::state::{Fault, Mode};
use fingertip::units::CoreCycles;

use super::analogue::Analogue;
use super::bridge::{self, Bridge, Encoder};
use super::capture::Keeper;
use super::exchange::{GAINS, HEARD, Heard, LOOP_STATE, LoopState, NotSaved, PARAMS, PICTURE, Report, SAVE, SAVED};
use super::flash::Store;
use super::guard::{self, Stopwatch, Watchdogs};
use super::scan::{Completed, Scan, WAKE};
use super::{health, trace};

/// The guard waits this many times as long for the first frame of a start as for a later one.
const FRAMES_TO_START: u32 = 4;

/// Everything that control owns.
pub struct Control {
    /// The array's scan.
    pub scan: Scan,
    /// The motor's bridge.
    pub bridge: Bridge,
    /// The motor's encoder.
    pub encoder: Encoder,
    /// The bridge's supply, and the microcontroller's temperature.
    pub analogue: Analogue,
    /// Fed here and nowhere else.
    pub watchdogs: Watchdogs,
    /// The parameters in flash.
    pub store: Store,
    /// The core.
    pub pipeline: &'static mut Pipeline,
    /// Reason why this board must not drive a motor: a fault that cannot be cleared.
    pub unfit: Option<Fault>,
}

/// Runs for ever.
#[embassy_executor::task]
pub async fn run(control: Control) {
    let mut state = ControlTask::new(control);
    state.start();
    loop {
        WAKE.wait().await;
        trace::Pin::Control.high();
        state.turn();
        trace::Pin::Control.low();
    }
}

struct ControlTask {
    parts: Control,
    frame: Frame,
    seen: u32,
    stamp: u32,
    discard_next: bool,
    /// The scan is not to be trusted before its next start.
    lost: bool,
    report: Report,
    bus: BusClock,
    time: FrameClock,
    clear_seen: u8,
    keeper: Keeper,
}

impl ControlTask {
    fn new(parts: Control) -> Self {
        Self {
            parts,
            frame: Frame::EMPTY,
            seen: 0,
            stamp: 0,
            discard_next: true,
            lost: false,
            report: Report::default(),
            bus: BusClock::default(),
            time: FrameClock::default(),
            clear_seen: 0,
            keeper: Keeper::default(),
        }
    }

    fn start(&mut self) {
        self.parts.watchdogs.start();
        self.restart_scan();
    }

    fn turn(&mut self) {
        if guard::take_trip() {
            self.without_frames();
            trace::Pin::Guard.low();
        }
        self.find_frames();
        // New parameters and gains act before the command of the same packet.
        self.configure();
        self.calibrate();
        self.capture();
        self.take_frame();
        self.begin_frame();
        self.save();
    }

    /// Restarts the scan when its fault is to be cleared, with torque off. The next step clears the fault.
    fn find_frames(&mut self) {
        if !self.lost {
            return;
        }
        let Command { torque, clear_request, .. } = HEARD.get().command;
        if clear_request != self.clear_seen && !torque {
            self.clear_seen = clear_request;
            self.restart_scan();
        }
    }

    fn take_frame(&mut self) {
        let newest = super::scan::newest();
        if newest.sequence == self.seen {
            return;
        }
        let follows = newest.sequence.wrapping_sub(self.seen) == 1;
        self.seen = newest.sequence;
        let before = core::mem::replace(&mut self.stamp, newest.stamp);
        if core::mem::take(&mut self.discard_next) {
            return;
        }
        // A frame that is not whole counts as missed: the guard runs on.
        if self.parts.scan.copy(newest, &mut self.frame) {
            self.step(newest);
        }
        if follows {
            let frame = guard::frame(self.parts.pipeline.config().timing);
            health::note_interval(Stopwatch(newest.stamp.wrapping_sub(before).saturating_sub(frame)));
        }
    }

    /// In the middle of a frame: reads the rows that are already there, and all that the step needs beside the frame and
    /// that may be half a frame old.
    fn begin_frame(&mut self) {
        if !super::scan::take_halfway() || self.discard_next {
            return;
        }
        self.parts.analogue.take();
        let rows = self.parts.scan.copy_so_far(&mut self.frame);
        if self.parts.pipeline.begin(&self.frame, rows) {
            self.parts.bridge.apply(Requested::Brakes);
            self.keeper.end(Ended::Cut);
            self.publish();
        }
    }

    fn step(&mut self, completed: Completed) {
        let parts = &mut self.parts;
        let Heard { command, packets } = HEARD.get();
        let sense = Sense {
            encoder: parts.encoder.read(),
            supply_mv: parts.analogue.supply_mv(),
            bus_silent_ms: self.bus.silent_ms(packets),
            bridge_fault: parts.bridge.fault(),
            chip: parts.analogue.chip(),
            // Before the first frame nothing is known: not 0, which would let any fit level in.
            answer: self.report.loop_time.cycles().max(CoreCycles(1)),
        };
        let (_, status) = parts.pipeline.step(&self.frame, &sense, &command);
        let stopped = status.mode == Mode::Fault;
        parts.bridge.apply(status.bridge());
        if let Some(fault) = parts.unfit
            && !stopped
        {
            parts.pipeline.stop(fault);
            self.keeper.end(Ended::Stopped);
        }

        let parts = &mut self.parts;
        let timing = parts.pipeline.config().timing;
        let loop_time = Stopwatch::since(completed.stamp);
        self.report.supply_mv = sense.supply_mv;
        self.report.loop_time = loop_time;
        self.report.frame_time_us = self.time.at_us(completed.stamp);
        self.report.frame_ns = timing.frame_ns;
        self.report.loop_time_max = self.report.loop_time_max.max(loop_time);
        if loop_time.cycles() <= timing.deadline {
            guard::restart(completed.stamp, 1, timing);
            parts.watchdogs.pet();
        } else {
            self.stop(Fault::MissedDeadline);
        }
        self.clear_seen = command.clear_request;
        self.publish();
        self.keeper.record(&self.frame, &sense, &command, self.parts.pipeline.status());
        self.keeper.follow(self.parts.pipeline);
    }

    /// Latches the fault after the guard cut the bridge. The scan restarts when the fault is cleared.
    ///
    /// The watchdog guards against firmware that hangs. Here it does not: it has seen the fault, and it feeds the
    /// watchdog only after reading back that the bridge is cut, so that the fault can be read on the bus.
    fn without_frames(&mut self) {
        self.stop(Fault::LostFrames);
        self.lost = true;
        super::scan::note_transfers();
        // These keep track of counters that wrap.
        self.parts.encoder.read();
        self.bus.silent_ms(HEARD.get().packets);
        self.time.at_us(guard::now());
        self.publish();
        if bridge::is_safe() {
            self.parts.watchdogs.pet();
        }
    }

    fn stop(&mut self, fault: Fault) {
        self.parts.bridge.sleep();
        self.parts.pipeline.stop(fault);
        self.keeper.end(Ended::Stopped);
    }

    fn restart_scan(&mut self) {
        let timing = self.parts.pipeline.config().timing;
        self.discard_next = true;
        self.lost = false;
        self.parts.scan.start(timing);
        self.parts.bridge.keep_step(timing);
        self.seen = super::scan::newest().sequence;
        guard::restart(guard::now(), FRAMES_TO_START, timing);
        self.parts.watchdogs.expect_frames(timing);
    }

    fn publish(&mut self) {
        self.report.capture = self.keeper.standing;
        let (pipeline, frame, report) = (&self.parts.pipeline, &self.frame, &self.report);
        let status = pipeline.status();
        LOOP_STATE.set(LoopState { mode: status.mode, fault: status.fault, missed_frames: status.missed_frames });
        // While the link answers from the snapshot, this one is skipped.
        PICTURE.visit(|picture| {
            picture.report = Some(Report { status: *status, ..*report });
            picture.frame = *frame;
            picture.taxels.copy_from_slice(&pipeline.array().picture().taxels);
            picture.pascals_per_sum_q32 = pipeline.config().pascals_per_sum_q32;
            picture.tare.iter_mut().zip(pipeline.array().tare()).for_each(|(to, tare)| *to = *tare);
        });
    }
}

const TICKS_PER_MS: u32 = guard::HZ / 1_000;

/// The stopwatch in microseconds, beyond its wrap.
#[derive(Default)]
struct FrameClock {
    /// The stopwatch at the last whole microsecond.
    last: u32,
    time_us: u32,
}

impl FrameClock {
    /// The time of an instant at most half a wrap of the stopwatch later than the last one. A frame that ended before
    /// its loss was noticed counts as from then.
    fn at_us(&mut self, instant: u32) -> u32 {
        let passed = instant.wrapping_sub(self.last);
        if passed.cast_signed() > 0 {
            let us = passed / guard::TICKS_PER_US;
            self.last = self.last.wrapping_add(us * guard::TICKS_PER_US);
            self.time_us = self.time_us.wrapping_add(us);
        }
        self.time_us
    }
}

/// Time for which the bus has been silent, measured where a hanging link cannot stop the clock.
#[derive(Default)]
struct BusClock {
    packets: u32,
    /// The stopwatch at the last whole millisecond of the silence.
    last: u32,
    silent_ms: u16,
}

impl BusClock {
    /// Milliseconds since the count of packets last changed.
    fn silent_ms(&mut self, packets: u32) -> u16 {
        let now = guard::now();
        if core::mem::replace(&mut self.packets, packets) != packets {
            (self.last, self.silent_ms) = (now, 0);
        }
        while now.wrapping_sub(self.last) >= TICKS_PER_MS {
            self.last = self.last.wrapping_add(TICKS_PER_MS);
            self.silent_ms = self.silent_ms.saturating_add(1);
        }
        self.silent_ms
    }
}

impl ControlTask {
    /// Stops the scan. The bridge keeps its state, but a driven motor is braked: without frames nothing limits its duty.
    fn rest(&mut self) {
        if let Requested::Driven(_) = self.parts.pipeline.status().bridge() {
            self.parts.bridge.apply(Requested::Brakes);
        }
        self.parts.scan.stop();
        guard::rest();
    }

    /// Begins a capture when it is due. The reset of the pipeline may take most of a frame, so the scan restarts.
    fn capture(&mut self) {
        self.keeper.take_asked();
        if self.keeper.is_due(self.parts.pipeline, || HEARD.get().command) {
            self.rest();
            self.keeper.begin(self.parts.pipeline);
            self.restart_scan();
        }
    }

    /// Applies new parameters. That takes longer than a frame, so the scan restarts.
    fn configure(&mut self) {
        let Some(params) = PARAMS.take(|params| *params) else { return };
        self.keeper.end(Ended::Configured);
        self.rest();
        self.parts.watchdogs.allow_long();
        if !set_config(self.parts.pipeline, &params) {
            self.stop(Fault::BrokenParameters);
        }
        self.restart_scan();
    }

    /// Takes new gains, which need a new tare. That may take most of a frame, so the scan restarts.
    fn calibrate(&mut self) {
        if let Some(gains) = GAINS.take(|gains| *gains) {
            self.keeper.end(Ended::Configured);
            self.rest();
            self.parts.pipeline.calibrate(&Calibration::of(&gains));
            self.restart_scan();
        }
    }

    /// Saves a record while the motor is off. The core halts while a word is written, for up to a frame's time: so
    /// the scan is stopped and restarts, and the bridge stays as it is.
    #[inline(never)]
    fn save(&mut self) {
        let Some(record) = SAVE.take(|record| *record) else { return };
        if !matches!(self.parts.pipeline.status().mode, Mode::Off | Mode::Fault) {
            return SAVED.signal(Err(NotSaved::Busy));
        }
        self.rest();
        let Control { store, watchdogs, .. } = &mut self.parts;
        watchdogs.allow_long();
        let saved = store.save(&record, || watchdogs.pet());
        self.restart_scan();
        SAVED.signal(saved.map_err(NotSaved::Failed));
    }
}

/// Applies parameters. Not inlined: a configuration is large and takes stack only here.
#[inline(never)]
fn set_config(pipeline: &mut Pipeline, params: &Params) -> bool {
    Config::shipped(params).is_ok_and(|config| {
        pipeline.configure(&config);
        true
    })
}
