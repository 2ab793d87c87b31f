//! The board's side of a scene: the world behind the pins, and the true state at each frame.

use super::joint::Joint;
use crate::inside::ROOM_C;
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use sim::SimError;
use sim::effects::sensor::{self, Readout, Stages as _};
use sim::effects::{Named, Parts, Set, link};
use sim::mechanics::Bridge;
use sim::scene::Scene;
use sim::setup::Array;
use sim::watch::{Cost, Truth};
use sim::world::{Surroundings, World};
use std::collections::VecDeque;

/// A frame as the converters made it, and the world at its end.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Number of frames converted so far, including this one.
    pub number: u64,
    /// Board time at which its last conversion ended, ns.
    pub end_ns: u64,
    /// Scene time at which its last conversion ended, s.
    pub time_s: f64,
    /// The codes.
    pub frame: Frame,
    /// Encoder and supply.
    pub sense: Sense,
    /// State of the world at this time.
    pub truth: Truth,
}

/// Conversion from board time to scene time: from `from_ns` on a second of the board lasts `second_s` in the scene.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    from_ns: u64,
    from_s: f64,
    second_s: f64,
}

impl Clock {
    /// Clock of a scene that begins at a time after power-on.
    pub fn new(start_ns: u64) -> Self {
        Self { from_ns: start_ns, from_s: 0.0, second_s: 1.0 }
    }

    /// The scene's time at an instant of the board.
    pub fn time_s(&self, at_ns: u64) -> f64 {
        self.from_s + (at_ns as f64 - self.from_ns as f64) * 1e-9 * self.second_s
    }

    /// The instant of the board at a time of the scene.
    pub fn at_ns(&self, time_s: f64) -> u64 {
        (self.from_ns as f64 + (time_s - self.from_s) / self.second_s * 1e9).max(0.0) as u64
    }

    /// Sets the duration of a board second from a board time on.
    pub fn run_at(&mut self, at_ns: u64, second_s: f64) {
        if second_s != self.second_s {
            *self = Self { from_ns: at_ns, from_s: self.time_s(at_ns), second_s };
        }
    }
}

/// A scene's finger.
pub struct Finger {
    /// The scene's time.
    pub clock: Clock,
    /// True if the next frames need their true pressures.
    pub wants_pressures: bool,
    bridge: Bridge,
    /// Scene time until which the world is frozen, s.
    from_s: f64,
    joint: Joint,
    sensor: sensor::Named,
    readout: Readout,
    reference_v: f64,
    /// Slots to come, and those sampled: the instants at which they begin.
    expected: VecDeque<(u64, u16)>,
    sampled: VecDeque<(u64, u16, [u16; COLUMNS])>,
    frame: Frame,
    seen: Vec<Seen>,
}

impl std::fmt::Debug for Finger {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Finger").field("clock", &self.clock).finish_non_exhaustive()
    }
}

impl Finger {
    /// All fingers of a scene, in a world that is frozen until a scene time, s.
    ///
    /// # Errors
    /// The world cannot be simulated.
    pub fn all(scene: &Scene, clock: Clock, moves_from_s: f64) -> Result<Vec<Self>, SimError> {
        let setup = scene.setup();
        let fingers = scene.table("hand").whole("fingers") as usize;
        let (mut sensors, mut effects) = (Vec::new(), Vec::new());
        for finger in 0..fingers {
            let Parts { sensor, contact, drive, .. } = Named::of(scene, finger);
            sensors.push(sensor);
            effects.push((drive, contact));
        }
        let world = World::new(&setup, &Surroundings::of(scene), effects);
        let joints = Joint::all(scene, world, moves_from_s)?;
        let finger = |(number, (joint, sensor))| Self {
            clock,
            wants_pressures: false,
            bridge: Bridge::Coast,
            from_s: moves_from_s,
            joint,
            sensor,
            readout: Readout::new(&setup.array).with_events(scene, number),
            reference_v: setup.array.reference_v,
            expected: VecDeque::new(),
            sampled: VecDeque::new(),
            frame: Frame::EMPTY,
            seen: Vec::new(),
        };
        Ok(joints.into_iter().zip(sensors).enumerate().map(finger).collect())
    }

    /// These slots are to come, with the rows driven in them. They may be asked for later than they begin, when the
    /// world has moved on: it lets them be sampled before.
    pub fn expect(&mut self, slots: impl Iterator<Item = (u64, u16)>) {
        let mut slots = slots.peekable();
        let first_ns = slots.peek().map_or(0, |(begun_ns, _)| *begun_ns);
        self.expected.retain(|(begun_ns, _)| *begun_ns < first_ns);
        self.expected.extend(slots);
    }

    /// The bridge does this from now on.
    pub fn hold(&mut self, bridge: Bridge) {
        self.bridge = bridge;
    }

    /// Goes to an instant of the board with the bridge held.
    pub fn advance(&mut self, to_ns: u64) {
        while let Some((begun_ns, rows)) = self.expected.pop_front_if(|(begun_ns, _)| *begun_ns < to_ns) {
            self.slot(rows, begun_ns);
        }
        self.joint.advance(to_ns, &self.clock, self.bridge);
    }

    /// The world's grid: it must come to each of its instants.
    pub fn grid_ns(&self) -> u64 {
        self.joint.grid_ns()
    }

    /// The supply at the bridge.
    pub fn supply_v(&self) -> f64 {
        self.joint.supply_v()
    }

    /// The microcontroller's temperature, a room's where the scene does not tell.
    pub fn chip_c(&self, at_ns: u64) -> f64 {
        self.sensor.chip_c(self.clock.time_s(at_ns)).unwrap_or(ROOM_C)
    }

    /// Counts of the encoder at a board time.
    pub fn encoder_counts(&self, at_ns: u64) -> i32 {
        self.joint.encoder_counts(self.clock.time_s(at_ns))
    }

    /// The converters' reference.
    pub fn reference_v(&self) -> f64 {
        self.reference_v
    }

    /// A column's code in the sequence that began at an instant. A sequence is sampled at once, at its beginning: both
    /// converters see one and the same readout of the slot.
    pub fn code(&mut self, column: usize, rows: u16, begun_ns: u64) -> u16 {
        self.slot(rows, begun_ns)[column]
    }

    fn slot(&mut self, rows: u16, begun_ns: u64) -> [u16; COLUMNS] {
        if let Some((_, _, codes)) = self.sampled.iter().find(|(ns, driven, _)| (*ns, *driven) == (begun_ns, rows)) {
            return *codes;
        }
        let codes = self.slot_codes(rows, begun_ns);
        self.sampled.truncate(SLOTS - 1);
        self.sampled.push_front((begun_ns, rows, codes));
        codes
    }

    fn slot_codes(&mut self, rows: u16, begun_ns: u64) -> [u16; COLUMNS] {
        let slot = match rows.count_ones() {
            0 => ROWS,
            1 => rows.trailing_zeros() as usize,
            // No scan drives two rows at once; a firmware that does sees its amplifiers at the rail.
            _ => return [Array::CODES as u16 - 1; COLUMNS],
        };
        let time_s = self.clock.time_s(begun_ns).max(self.from_s);
        let kpa = if slot < ROWS { self.joint.row_kpa(time_s, slot) } else { [0.0; COLUMNS] };
        let codes = self.readout.codes(&mut self.sensor, slot, time_s, &kpa);
        for (column, code) in codes.into_iter().enumerate() {
            self.frame.set_code(slot.min(SLOTS - 1), column, code);
        }
        codes
    }

    /// The last slot of a frame was converted.
    pub fn frame_done(&mut self, number: u64, end_ns: u64) {
        self.advance(end_ns);
        let time_s = self.joint.now_s();
        let (sense, truth) = self.joint.look(self.wants_pressures);
        self.frame.sequence = number as u32;
        self.seen.push(Seen { number, end_ns, time_s, frame: self.frame, sense, truth });
    }

    /// Takes the frames made since the last time.
    pub fn take_seen(&mut self) -> Vec<Seen> {
        std::mem::take(&mut self.seen)
    }

    /// Costs of the effects on sensor, contact and drive.
    pub fn costs(&self) -> Vec<Cost> {
        self.joint.costs(|contact, drive| Named::costs(&self.sensor, contact, drive, &link::Named::default()))
    }
}
