//! The native board with the bus in place of a scene's host: each finger is a device, their IDs count from 1.
//!
//! The bytes are those of the firmware: the same core and the same [`Server`]. What the firmware's tasks do around them
//! is done here: a request is passed on with the next frame, a reply leaves after its delay, parameters that change make
//! a new configuration, those that are saved outlive a reboot. What lies outside is not simulated: the time that bytes
//! take on the line, the time that the microcontroller takes to start, to save and to answer (loop times read 0).

mod broken;
mod object;

pub use broken::Kind;

use super::{Begun, Board, SimError};
use crate::bridge::Bridge;
use crate::effects::set::Set;
use crate::scene::Scene;
use crate::watch::Truth;
use broken::Broken;
use fingertip::capture::Ended;
use fingertip::link::{Captured, Crash, Health, Reply, ResetCause};
use fingertip::pipeline::Status;
use fingertip::shipped::{CLOCKS, Calibration, Capture, Config, Pipeline, ROWS, Record, SLOTS, Server, Snapshot};
use fingertip::state::{Fault, Mode};
use fingertip::store::settle;
use object::Object;
use std::collections::VecDeque;

/// Bytes for the host, and when they are due.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Virtual time.
    pub due_s: f64,
    /// A whole packet, or a device's part of one.
    pub bytes: Vec<u8>,
}

/// The fingers of a scene on a bus.
pub struct Bus<E: Set> {
    board: Board<E>,
    devices: Vec<Device>,
    object: Object,
    answers: VecDeque<Answer>,
}

/// What a finger's firmware keeps beside its pipeline.
struct Device {
    server: Server,
    /// What its flash holds.
    flash: Record,
    started_s: f64,
    reset: ResetCause,
    /// The encoder counts from where it started.
    encoder_start: i32,
    /// How many good packets there were, and when that last changed.
    packets: (u32, f64),
    broken: Option<Broken>,
    /// As the controller sensed it last.
    supply_mv: u16,
    reboot_s: Option<f64>,
    capture: Box<Capture>,
}

impl<E: Set> Bus<E> {
    /// At power-on: torque off, not tared, nothing stored but what the scene says.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let board = Board::<E>::new(&scene.without_events(), Begun::default())?;
        let device = |finger: usize| {
            let flash = Record { id: 1 + finger as u8, params: board.params, ..Record::DEFAULT };
            Device::new(flash, ResetCause::PowerOn, 0.0)
        };
        let devices = (0..board.units.len()).map(device).collect();
        let object = Object::new(&board.world);
        Ok(Self { board, devices, object, answers: VecDeque::new() })
    }

    /// Virtual time.
    pub fn now_s(&self) -> f64 {
        self.board.time_s()
    }

    /// How long a frame takes.
    pub fn frame_s(&self) -> f64 {
        self.board.slot_s * SLOTS as f64
    }

    /// The bus speed that the devices listen at: the first one's.
    pub fn baud(&self) -> u32 {
        self.devices[0].server.settings().baud()
    }

    /// What is true of each finger, and what its controller reports.
    pub fn truths(&mut self) -> Vec<(Truth, Status)> {
        let board = &mut self.board;
        let truths = board.units.iter().enumerate();
        truths.map(|(finger, unit)| (board.world.truth(finger, false), *unit.pipeline.status())).collect()
    }

    /// One frame of each finger, and its control step.
    pub fn frame(&mut self) {
        let frame_s = self.frame_s();
        self.object.approach(&mut self.board.world, frame_s);
        self.board.scan();
        let now_s = self.now_s();
        for (finger, device) in self.devices.iter_mut().enumerate() {
            let board = &mut self.board;
            if device.reboot_s.is_some_and(|at_s| at_s <= now_s) {
                let encoder = board.sense(finger, 0).encoder;
                *device = Device { encoder_start: encoder, broken: device.broken.take(), ..device.rebooted(now_s) };
                board.units[finger].pipeline = device.pipeline();
                board.units[finger].frame.sequence = 0;
            }
            let mut sense = board.sense(finger, device.silent_ms(now_s));
            let unit = &mut board.units[finger];
            unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
            sense.encoder = sense.encoder.wrapping_sub(device.encoder_start);
            let params = &unit.pipeline.config().params;
            let scanned =
                device.broken.as_mut().is_none_or(|broken| broken.change(&mut unit.frame, &mut sense, params));
            device.supply_mv = sense.supply_mv;
            let command = device.server.command();
            if device.capture.is_due(unit.pipeline.status(), &command) {
                device.capture.begin(&mut unit.pipeline);
            }
            let status = if scanned {
                let (_, status) = unit.pipeline.step(&unit.frame, &sense, &command);
                device.capture.record(&unit.frame, &sense, &command, status);
                device.capture.follow(&unit.pipeline);
                unit.pipeline.status()
            } else {
                unit.pipeline.stop(Fault::LostFrames);
                device.capture.end(Ended::Stopped);
                unit.pipeline.status()
            };
            let bridge = Bridge::of(status);
            unit.next = device.broken.as_ref().map_or(bridge, |broken| broken.at_motor(bridge));
        }
    }

    /// Takes what the host sends.
    pub fn hear(&mut self, bytes: &[u8]) {
        let now_s = self.now_s();
        let mut said: VecDeque<(usize, Answer)> = (0..self.devices.len())
            .flat_map(|finger| self.feed(finger, bytes, now_s).into_iter().map(move |answer| (finger, answer)))
            .collect();
        // A device hears the others, and may have waited for one of them.
        while let Some((from, answer)) = said.pop_front() {
            for finger in (0..self.devices.len()).filter(|finger| *finger != from) {
                let heard = self.feed(finger, &answer.bytes, answer.due_s);
                said.extend(heard.into_iter().map(|answer| (finger, answer)));
            }
            let place = self.answers.partition_point(|other| other.due_s <= answer.due_s);
            self.answers.insert(place, answer);
        }
    }

    /// When the next answer is due.
    pub fn due_s(&self) -> Option<f64> {
        self.answers.front().map(|answer| answer.due_s)
    }

    /// The next answer that is due by a time.
    pub fn answer(&mut self, by_s: f64) -> Option<Answer> {
        self.answers.pop_front_if(|answer| answer.due_s <= by_s)
    }

    /// Has a device hear bytes at a time; what it answers.
    fn feed(&mut self, finger: usize, mut bytes: &[u8], at_s: f64) -> Vec<Answer> {
        let (mut answers, mut reply) = (Vec::new(), Reply::new());
        while !bytes.is_empty() {
            let device = &mut self.devices[finger];
            let unit = &mut self.board.units[finger];
            let (pipeline, mut tare) = (&unit.pipeline, [[0; _]; ROWS]);
            tare.iter_mut().zip(pipeline.array().tare()).for_each(|(to, tare)| *to = *tare);
            let snapshot = Snapshot {
                status: *pipeline.status(),
                supply_mv: device.supply_mv,
                tick_ms: ((at_s - device.started_s) * 1e3) as u64 as u32,
                frame_time_us: ((self.board.clock.since(self.board.start) - device.started_s) * 1e6) as u64 as u32,
                frame_ns: pipeline.config().timing.frame_ns,
                loop_time_us: 0,
                loop_time_max_us: 0,
                reset_cause: device.reset,
                crash: Crash::default(),
                // There is no board.
                health: Health::default(),
                frame: &unit.frame,
                taxels: &pipeline.array().picture().taxels,
                pascals_per_sum_q32: pipeline.config().pascals_per_sum_q32,
                tare: &tare,
                capture: Captured { standing: device.capture.standing(), data: device.capture.data() },
            };
            let taken = device.server.feed(bytes, &snapshot, &mut reply);
            bytes = &bytes[taken..];
            let due_s = at_s + f64::from(device.server.reply_delay_us()) * 1e-6;
            if !reply.is_empty() {
                answers.push(Answer { due_s, bytes: reply.to_vec() });
            }
            let scan = device.carry_out(&mut unit.pipeline, due_s);
            if let Some(slot_s) = scan {
                self.board.slot_s = slot_s;
            }
        }
        answers
    }
}

impl Device {
    fn new(flash: Record, reset: ResetCause, started_s: f64) -> Self {
        Self {
            server: Server::new(flash, &CLOCKS),
            flash,
            started_s,
            reset,
            encoder_start: 0,
            packets: (0, started_s),
            broken: None,
            supply_mv: 0,
            reboot_s: None,
            capture: Box::new(Capture::NEW),
        }
    }

    fn rebooted(&self, now_s: f64) -> Self {
        Self::new(self.flash, ResetCause::Software, now_s)
    }

    /// As the firmware makes it of what is stored.
    fn pipeline(&self) -> Pipeline {
        let (mut params, mut sound) = (self.flash.params, true);
        let config = settle(&mut params, Config::shipped, |_| sound = false);
        let mut pipeline = Pipeline::new(&config.expect("the defaults make a configuration"));
        pipeline.calibrate(&Calibration::of(&self.flash.gains));
        if !sound {
            pipeline.stop(Fault::BrokenParameters);
        }
        pipeline
    }

    /// Since the last good packet.
    fn silent_ms(&mut self, now_s: f64) -> u16 {
        let packets = self.server.good_packets();
        if packets != self.packets.0 {
            self.packets = (packets, now_s);
        }
        ((now_s - self.packets.1) * 1e3) as u16
    }

    /// What the server asks of the firmware. The new time of a slot, where the scan changed.
    fn carry_out(&mut self, pipeline: &mut Pipeline, replied_s: f64) -> Option<f64> {
        let actions = self.server.take_actions();
        let record = self.server.settings().record;
        let mut slot_s = None;
        if actions.configure || actions.calibrate {
            self.capture.end(Ended::Configured);
        }
        match actions.capture {
            Some(true) => self.capture.arm(),
            Some(false) => self.capture.end(Ended::Asked),
            None => {}
        }
        if actions.configure {
            match Config::shipped(&record.params) {
                Ok(config) => {
                    pipeline.configure(&config);
                    slot_s = Some(f64::from(config.timing.slot.0) / f64::from(CLOCKS.timer_hz));
                }
                Err(_) => pipeline.stop(Fault::BrokenParameters),
            }
        }
        if actions.calibrate {
            pipeline.calibrate(&Calibration::of(&record.gains));
        }
        if actions.save {
            let rests = matches!(pipeline.status().mode, Mode::Off | Mode::Fault);
            if rests {
                self.flash = record;
            }
            self.server.note_saved(rests);
        }
        if actions.reboot {
            self.reboot_s = Some(replied_s);
        }
        slot_s
    }
}

/// What is true of a finger, beside what its controller reports.
pub fn line(truth: &Truth, status: &Status) -> String {
    let sensed_n = f64::from(status.contact.force.0);
    let fault = status.fault.map_or(String::new(), |fault| format!(", fault {} ({fault:?})", fault as u32));
    format!(
        "{:?}{fault}: travel {:.3} mm, true force {:.3} N, sensed {sensed_n:.3} N",
        status.mode, truth.travel_mm, truth.force_n
    )
}
