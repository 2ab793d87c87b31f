//! Native board with the bus in place of the host of a scene: each finger is a device, and IDs count from 1.
//!
//! The bytes are those of the firmware: the same core and the same [`Server`]. This module does what the tasks of the
//! firmware do around them: a request is passed on with the next frame, a reply leaves after its delay, changed
//! parameters make a new configuration, and saved ones survive a reboot. Not simulated are the time of bytes on the
//! line, and the time in which the microcontroller starts, saves and answers (loop times read 0).

use crate::effects::stream;
use crate::mechanics::Bridge;
use crate::native::{Board, SimError};
use crate::scene::Scene;
use crate::watch::Truth;
use crate::world::World;
use clap::ValueEnum;
use fingertip::capture::Ended;
use fingertip::frame::Sense;
use fingertip::link::{Captured, Crash, Health, Reply, ResetCause};
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{
    CLOCKS, COLUMNS, Calibration, Capture, Config, Frame, Pipeline, ROWS, Record, SLOTS, Server, Snapshot,
};
use fingertip::state::{Fault, Mode};
use fingertip::store::settle;
use std::collections::VecDeque;

#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Virtual time at which they are due.
    pub due_s: f64,
    /// Whole packet, or the part of a device.
    pub bytes: Vec<u8>,
}

/// The fingers of a scene on a bus.
pub struct Bus {
    board: Board,
    devices: Vec<Device>,
    object: Object,
    answers: VecDeque<Answer>,
}

/// Firmware of a finger around its pipeline.
struct Device {
    server: Server,
    flash: Record,
    chip_id: u32,
    started_s: f64,
    reset: ResetCause,
    encoder_start: i32,
    /// Number of good packets, and the time of its last change.
    packets: (u32, f64),
    broken: Option<Broken>,
    /// The last frame as the controller received it, with what is broken.
    frame: Frame,
    /// Time of that frame's end, and supply voltage that the controller sensed with that frame.
    frame_time_us: u32,
    supply_mv: u16,
    reboot_s: Option<f64>,
    capture: Box<Capture>,
}

impl Bus {
    /// Powers the fingers on: torque off, not tared, nothing stored but the values of the scene.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let board = Board::new(&scene.without_events())?;
        let device = |finger: usize| {
            let flash = Record { id: 1 + finger as u8, params: board.params, ..Record::DEFAULT };
            Device::new(flash, stream(scene.seed, "chip", finger) as u32, ResetCause::PowerOn, 0.0)
        };
        let devices = (0..board.units.len()).map(device).collect();
        let object = Object::new(&board.world);
        Ok(Self { board, devices, object, answers: VecDeque::new() })
    }

    pub fn now_s(&self) -> f64 {
        self.board.time_s()
    }

    pub fn frame_s(&self) -> f64 {
        self.board.slot_s * SLOTS as f64
    }

    /// Bus speed of the first device.
    pub fn baud(&self) -> u32 {
        self.devices[0].server.settings().baud()
    }

    /// Returns the true state and the status of each finger.
    pub fn truths(&mut self) -> Vec<(Truth, Status)> {
        let board = &mut self.board;
        let truths = board.units.iter().enumerate();
        truths.map(|(finger, unit)| (board.world.truth(finger, false), *unit.pipeline.status())).collect()
    }

    /// Scans one frame of each finger and takes its control step.
    pub fn frame(&mut self) {
        let frame_s = self.frame_s();
        self.object.approach(&mut self.board.world, frame_s);
        self.board.scan();
        let now_s = self.now_s();
        for (finger, device) in self.devices.iter_mut().enumerate() {
            let board = &mut self.board;
            if device.reboot_s.is_some_and(|at_s| at_s <= now_s) {
                let encoder = board.sense(finger, 0).encoder;
                let rebooted = Device::new(device.flash, device.chip_id, ResetCause::Software, now_s);
                *device = Device { encoder_start: encoder, broken: device.broken.take(), ..rebooted };
                board.units[finger].pipeline = device.pipeline();
                board.units[finger].frame.sequence = 0;
            }
            let mut sense = board.sense(finger, device.silent_ms(now_s));
            let unit = &mut board.units[finger];
            unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
            sense.encoder = sense.encoder.wrapping_sub(device.encoder_start);
            let params = &unit.pipeline.config().params;
            device.frame = unit.frame;
            let frame = &mut device.frame;
            let scanned = device.broken.as_mut().is_none_or(|broken| broken.change(frame, &mut sense, params));
            let command = device.server.command();
            if device.capture.is_due(&unit.pipeline, &command) {
                device.capture.begin(&mut unit.pipeline);
            }
            if scanned {
                device.frame_time_us = ((now_s - device.started_s) * 1e6) as u64 as u32;
                device.supply_mv = sense.supply_mv;
                let (_, status) = unit.pipeline.step(frame, &sense, &command);
                device.capture.record(frame, &sense, &command, status);
                device.capture.follow(&unit.pipeline);
            } else {
                unit.pipeline.stop(Fault::LostFrames);
                device.capture.end(Ended::Stopped);
            }
            let bridge = Bridge::of(unit.pipeline.status());
            unit.next = device.broken.as_ref().map_or(bridge, |broken| broken.at_motor(bridge));
        }
    }

    pub fn hear(&mut self, bytes: &[u8]) {
        let now_s = self.now_s();
        let mut said: VecDeque<(usize, Answer)> = (0..self.devices.len())
            .flat_map(|finger| self.feed(finger, bytes, now_s).into_iter().map(move |answer| (finger, answer)))
            .collect();
        // A device also receives the answers of the others, and may wait for one of them.
        while let Some((from, answer)) = said.pop_front() {
            for finger in (0..self.devices.len()).filter(|finger| *finger != from) {
                let heard = self.feed(finger, &answer.bytes, answer.due_s);
                said.extend(heard.into_iter().map(|answer| (finger, answer)));
            }
            let place = self.answers.partition_point(|other| other.due_s <= answer.due_s);
            self.answers.insert(place, answer);
        }
    }

    pub fn due_s(&self) -> Option<f64> {
        self.answers.front().map(|answer| answer.due_s)
    }

    /// Returns the next answer that is due by a time.
    pub fn answer(&mut self, by_s: f64) -> Option<Answer> {
        self.answers.pop_front_if(|answer| answer.due_s <= by_s)
    }

    /// Passes bytes to a device and returns its answers.
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
                frame_time_us: device.frame_time_us,
                frame_ns: pipeline.config().timing.frame_ns,
                loop_time_us: 0,
                loop_time_max_us: 0,
                reset_cause: device.reset,
                crash: Crash::default(),
                health: Health { chip_id: device.chip_id, ..Health::default() },
                frame: &device.frame,
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
    fn new(flash: Record, chip_id: u32, reset: ResetCause, started_s: f64) -> Self {
        Self {
            server: Server::new(flash, &CLOCKS),
            flash,
            chip_id,
            started_s,
            reset,
            encoder_start: 0,
            packets: (0, started_s),
            broken: None,
            frame: Frame::EMPTY,
            frame_time_us: 0,
            supply_mv: 0,
            reboot_s: None,
            capture: Box::new(Capture::NEW),
        }
    }

    /// Builds the pipeline from the stored values, as the firmware does.
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

    fn silent_ms(&mut self, now_s: f64) -> u16 {
        let packets = self.server.good_packets();
        if packets != self.packets.0 {
            self.packets = (packets, now_s);
        }
        ((now_s - self.packets.1) * 1e3) as u16
    }

    /// Carries out the actions of the server. Returns the time of a slot if the scan changed.
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

pub fn line(truth: &Truth, status: &Status) -> String {
    let sensed_n = f64::from(status.contact.force.0);
    let fault = status.fault.map_or(String::new(), |fault| format!(", fault {} ({fault:?})", fault as u32));
    format!(
        "{:?}{fault}: travel {:.3} mm, true force {:.3} N, sensed {sensed_n:.3} N",
        status.mode, truth.travel_mm, truth.force_n
    )
}

/// Distance of an object out of reach.
const AWAY_MM: f64 = 1e3;
/// Speed of the object if the command gives none.
const MM_PER_S: f64 = 20.0;
/// Largest speed of the object: its surface moves in steps of a frame.
const MM_PER_S_MAX: f64 = 500.0;
/// Gap between an object that is put in place and a tip beyond that place.
const GAP_MM: f64 = 0.2;

struct Object {
    scene_mm: f64,
    now_mm: f64,
    goal_mm: f64,
    mm_per_s: f64,
}

impl Object {
    fn new(world: &World) -> Self {
        let scene_mm = world.fingers[0].setup.wall.distance_mm;
        Self { scene_mm, now_mm: scene_mm, goal_mm: scene_mm, mm_per_s: MM_PER_S }
    }

    fn approach(&mut self, world: &mut World, dt_s: f64) {
        if self.now_mm != self.goal_mm {
            let most_mm = self.mm_per_s * dt_s;
            self.now_mm += (self.goal_mm - self.now_mm).clamp(-most_mm, most_mm);
            self.place(world);
        }
    }

    fn jump(&mut self, world: &mut World, to_mm: f64) {
        (self.now_mm, self.goal_mm) = (to_mm, to_mm);
        self.place(world);
    }

    fn place(&self, world: &mut World) {
        world.fingers.iter_mut().for_each(|finger| finger.setup.wall.distance_mm = self.now_mm);
    }
}

/// Commands of [`Bus::command`].
pub const HELP: &str = "\
remove               takes the object away
put                  puts it back where the scene has it, or in front of a tip that is beyond
move MM [MM_PER_S]   moves its surface to where the tip meets it at this travel, at 20 mm/s or as said
fault KIND [FINGER]  breaks something until it is mended; without KIND, says what can be broken
mend                 mends all that is broken; the controller's fault remains until the host clears it
state                says what is true of each finger
help                 says this
";

impl Bus {
    /// Carries out a line of text and returns what was done. The error is for people.
    pub fn command(&mut self, text: &str) -> Result<String, String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            [] => Ok(String::new()),
            ["help"] => Ok(HELP.trim_end().into()),
            ["state"] => Ok(self.state()),
            ["remove"] => {
                self.object.jump(&mut self.board.world, AWAY_MM);
                Ok("the object is taken away".into())
            }
            ["put"] => {
                let tip_mm = self.board.world.fingers.iter().map(|finger| finger.now.tip_mm).fold(f64::MIN, f64::max);
                let to_mm =
                    self.object.scene_mm.max(if tip_mm > self.object.scene_mm { tip_mm + GAP_MM } else { tip_mm });
                self.object.jump(&mut self.board.world, to_mm);
                Ok(format!("the object is at {to_mm:.2} mm"))
            }
            ["move", to_mm] => self.move_object(to_mm, MM_PER_S),
            ["move", to_mm, mm_per_s] => self.move_object(to_mm, number(mm_per_s, "MM_PER_S", 0.001, MM_PER_S_MAX)?),
            ["fault"] => Ok(format!("what can be broken: {}", Kind::names())),
            ["fault", kind] => self.break_one(kind, "1"),
            ["fault", kind, finger] => self.break_one(kind, finger),
            ["mend"] => {
                self.devices.iter_mut().for_each(|device| device.broken = None);
                Ok("all is mended".into())
            }
            _ => Err(format!("`{text}` is no command; those that are:\n{}", HELP.trim_end())),
        }
    }

    fn state(&mut self) -> String {
        let object = &self.object;
        let object = match object.now_mm {
            AWAY_MM.. => "the object is away".into(),
            mm if mm == object.goal_mm => format!("the object is at {mm:.2} mm"),
            mm => format!("the object is at {mm:.2} mm on its way to {:.2} mm", object.goal_mm),
        };
        let fingers = self.truths();
        let lines =
            fingers.iter().enumerate().map(|(n, (truth, status))| format!("finger {}: {}", n + 1, line(truth, status)));
        lines.chain([object]).collect::<Vec<_>>().join("\n")
    }

    fn move_object(&mut self, to_mm: &str, mm_per_s: f64) -> Result<String, String> {
        if self.devices.len() > 1 {
            return Err("the object lies between two fingers: it cannot be moved towards one".into());
        }
        let to_mm = number(to_mm, "MM", -100.0, 100.0)?;
        // An object that was away starts where it cannot touch.
        if self.object.now_mm == AWAY_MM {
            let tip_mm = self.board.world.fingers[0].now.tip_mm;
            self.object.jump(&mut self.board.world, to_mm.max(tip_mm + GAP_MM));
        }
        (self.object.goal_mm, self.object.mm_per_s) = (to_mm, mm_per_s);
        Ok(format!("the object moves to {to_mm:.2} mm at {mm_per_s:.3} mm/s"))
    }

    fn break_one(&mut self, kind: &str, finger: &str) -> Result<String, String> {
        let count = self.devices.len();
        let known = Kind::from_str(kind, false);
        let broken = known.map_err(|_| format!("no fault `{kind}`: there are {}", Kind::names()))?;
        let device = finger.parse::<usize>().ok().and_then(|finger| self.devices.get_mut(finger.wrapping_sub(1)));
        let device = device.ok_or_else(|| format!("no finger `{finger}`: 1 to {count} are there"))?;
        device.broken = Some(Broken { kind: broken, then: None });
        Ok(format!("finger {finger}: {kind} from now on; `mend` ends it"))
    }
}

fn number(text: &str, name: &str, least: f64, most: f64) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (least..=most).contains(number));
    number.ok_or_else(|| format!("{name} of `{text}`: needs a number from {least} to {most}"))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// No frame arrives: fault 1.
    LostFrames,
    /// The first row of the array is disconnected: fault 2.
    ArrayBroken,
    /// A row remains driven: fault 3.
    RowStuck,
    /// The array repeats its last codes: fault 4, once the tip moves.
    ArrayFrozen,
    /// The count of the encoder is frozen: fault 5, once the motor is driven.
    EncoderFrozen,
    /// The supply is below its limit: fault 9.
    SupplyLow,
    /// The supply is above its limit: fault 10.
    SupplyHigh,
    /// The bridge's driver reports a fault: fault 11.
    Bridge,
    /// The encoder counts backwards, its channels are swapped: fault 15, once the motor is driven.
    EncoderReversed,
    /// The motor's leads are swapped: fault 15, once the motor is driven.
    LeadsSwapped,
}

impl Kind {
    /// Names of all defects, as a command has them.
    fn names() -> String {
        let values = Self::value_variants().iter().filter_map(Self::to_possible_value);
        values.map(|value| value.get_name().to_owned()).collect::<Vec<_>>().join(", ")
    }
}

/// A defect that lasts until it is mended.
struct Broken {
    kind: Kind,
    /// Frame and encoder count when it broke.
    then: Option<(Frame, i32)>,
}

/// Codes that a row adds to each slot while it remains driven.
const STUCK_CODES: u16 = 1_000;
/// Distance of the supply from its allowed range, mV.
const BEYOND_MV: i32 = 500;

impl Broken {
    fn at_motor(&self, bridge: Bridge) -> Bridge {
        match (self.kind, bridge) {
            (Kind::LeadsSwapped, Bridge::Driven { duty }) => Bridge::Driven { duty: -duty },
            _ => bridge,
        }
    }

    /// Changes the inputs of the controller. Returns false if no frame arrives.
    fn change(&mut self, frame: &mut Frame, sense: &mut Sense, params: &Params) -> bool {
        let (frozen, encoder) = self.then.get_or_insert((*frame, sense.encoder));
        match self.kind {
            Kind::LostFrames => return false,
            Kind::ArrayBroken => {
                (0..COLUMNS).for_each(|column| frame.set_code(0, column, frame.code(SLOTS - 1, column)))
            }
            Kind::RowStuck => {
                for slot in 0..=ROWS {
                    for column in 0..COLUMNS {
                        frame.set_code(slot, column, (frame.code(slot, column) + STUCK_CODES).min(4_095));
                    }
                }
            }
            Kind::ArrayFrozen => frame.codes = frozen.codes,
            Kind::EncoderFrozen => sense.encoder = *encoder,
            Kind::EncoderReversed => sense.encoder = encoder.wrapping_mul(2).wrapping_sub(sense.encoder),
            Kind::SupplyLow => sense.supply_mv = millivolts(params.supply_min_mv - BEYOND_MV),
            Kind::SupplyHigh => sense.supply_mv = millivolts(params.supply_max_mv + BEYOND_MV),
            Kind::Bridge => sense.bridge_fault = true,
            Kind::LeadsSwapped => {}
        }
        true
    }
}

fn millivolts(value: i32) -> u16 {
    value.clamp(0, i32::from(u16::MAX)) as u16
}
