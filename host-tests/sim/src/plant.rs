//! Plant: the reference finger of `docs/board.md` with its array, moved step by step.
//!
//! The plant is a finger in the world of scenes, with these differences: its effects are part of its [`Setup`], it can
//! be broken during a run ([`Faults`]), and its rows are driven pin by pin.

pub use crate::setup::Setup;

use crate::effects::drive::{self, Circuit, Friction};
use crate::effects::sensor::{self, Readout, Settling};
use crate::effects::{Parts, Set, contact, link};
use crate::mechanics::{Bridge, Finger, decay};
use crate::scene::Scene;
use crate::setup::Array;
use crate::world::{Surroundings, World};
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};

/// Finger and its array at one instant.
pub struct Plant {
    /// Defects; may be changed at any time.
    pub faults: Faults,
    world: World<Reference>,
    sensor: Sensor,
    readout: Readout,
}

impl Plant {
    /// Creates a plant at rest at travel 0, with the bridge open.
    pub fn new(setup: &Setup) -> Self {
        let world = World::new(setup, &Surroundings::default(), vec![(Drive::new(setup), contact::Named::default())]);
        let (sensor, readout) = (Sensor::new(&setup.array), Readout::new(&setup.array));
        Self { faults: Faults::default(), world, sensor, readout }
    }

    pub fn finger(&self) -> &Finger<Drive> {
        &self.world.fingers[0]
    }

    pub fn finger_mut(&mut self) -> &mut Finger<Drive> {
        &mut self.world.fingers[0]
    }

    /// Advances by one step with a constant bridge. The tests cover steps of 10 us.
    pub fn advance(&mut self, dt_s: f64, bridge: Bridge) {
        self.finger_mut().drive.faults = self.faults;
        self.world.advance(0.0, dt_s, &[bridge]);
        // A frozen count keeps the value of its last read.
        self.finger_mut().count_ahead(0.0);
    }

    /// Puts the tip at rest at a travel.
    pub fn place(&mut self, travel_mm: f64) {
        self.finger_mut().place(travel_mm);
        self.advance(0.0, Bridge::Coast);
    }

    pub fn travel_mm(&self) -> f64 {
        self.finger().now.tip_mm
    }

    /// Indentation of the tip; 0 without contact.
    pub fn indentation_mm(&self) -> f64 {
        (self.travel_mm() - self.finger().setup.wall.distance_mm).max(0.0)
    }

    pub fn force_n(&self) -> f64 {
        self.world.force_n(0)
    }

    /// Count of the timer in encoder mode, unwrapped.
    pub fn encoder_counts(&self) -> i32 {
        self.finger().drive.counts
    }

    /// Returns what the control step receives beside the frame.
    pub fn sense(&mut self, bus_silent_ms: u16) -> Sense {
        self.world.sense(0, bus_silent_ms)
    }

    /// Mean pressure on a taxel.
    ///
    /// # Panics
    /// The row or the column is beyond the array, as in all methods below.
    pub fn pressure_kpa(&mut self, row: usize, column: usize) -> f64 {
        self.world.row_kpa(0, f64::INFINITY, row)[column]
    }

    /// Settled voltages of all columns while these rows are driven.
    pub fn settled_volts(&mut self, driven: &[bool; ROWS]) -> [f64; COLUMNS] {
        let (array, faults) = (self.finger().setup.array, self.faults.array);
        if faults.saturated {
            return [array.reference_v; COLUMNS];
        }
        self.sensor.faults = faults;
        let mut volts = [array.ground_v; COLUMNS];
        for (row, _) in faults.driven(driven).iter().enumerate().filter(|(_, driven)| **driven) {
            let kpa = self.world.row_kpa(0, f64::INFINITY, row);
            self.readout.add_row(&mut self.sensor, row, 0.0, &kpa, &mut volts);
        }
        volts.map(|v| v.min(array.reference_v))
    }

    /// Fills a frame with the codes of this instant and increments its sequence number.
    pub fn fill_frame(&mut self, frame: &mut Frame) {
        for slot in 0..SLOTS {
            for (column, code) in self.slot_codes(slot).into_iter().enumerate() {
                frame.set_code(slot, column, code);
            }
        }
        frame.sequence = frame.sequence.wrapping_add(1);
    }

    /// Codes of a slot, sampled [`crate::setup::Array::sample_after_s`] after its edge.
    pub fn slot_codes(&mut self, slot: usize) -> [u16; COLUMNS] {
        let array = self.finger().setup.array;
        let [before, end] = [(slot + SLOTS - 1) % SLOTS, slot].map(|slot| self.settled_volts(&driven_in(slot)));
        let left = decay(array.sample_after_s / array.settle_tau_s);
        core::array::from_fn(|column| array.code(end[column] + left * (before[column] - end[column])))
    }
}

/// Rows that are driven in a slot of the scan: one, or none in the last slot.
fn driven_in(slot: usize) -> [bool; ROWS] {
    core::array::from_fn(|row| row == slot)
}

impl Clone for Plant {
    fn clone(&self) -> Self {
        let (mut plant, finger) = (Self::new(&self.finger().setup), self.finger());
        plant.faults = self.faults;
        plant.finger_mut().now = finger.now;
        plant.finger_mut().drive.counts = finger.drive.counts;
        plant
    }
}

impl core::fmt::Debug for Plant {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Plant").field("faults", &self.faults).finish_non_exhaustive()
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Taxel {
    #[default]
    Sound,
    /// An open circuit: no preload, no pressure.
    Dead,
    Shorted,
}

/// State of the switch of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Row {
    #[default]
    Sound,
    /// Stuck in the driven state (its pin high).
    StuckHigh,
    /// Never driven (its pin low).
    StuckLow,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArrayFaults {
    pub taxels: [[Taxel; COLUMNS]; ROWS],
    pub rows: [Row; ROWS],
    /// True if all amplifiers are at their upper rail.
    pub saturated: bool,
}

impl ArrayFaults {
    /// Returns the rows that are actually driven for these requests.
    fn driven(&self, asked: &[bool; ROWS]) -> [bool; ROWS] {
        core::array::from_fn(|row| match self.rows[row] {
            Row::Sound => asked[row],
            Row::StuckHigh => true,
            Row::StuckLow => false,
        })
    }
}

/// Defects of the board.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    pub array: ArrayFaults,
    pub encoder_frozen: bool,
    /// True if the channels of the encoder are swapped: it counts down as the tip presses.
    pub encoder_reversed: bool,
    /// True if the leads of the motor are swapped: a positive duty moves the tip back.
    pub leads_swapped: bool,
    /// Travels at the end stops of the finger, rear and front.
    pub end_stops_mm: Option<[f64; 2]>,
    pub supply_drop_v: f64,
}

/// Effects of the reference finger, which may break during a run.
pub struct Reference;

impl Reference {
    pub fn parts(setup: &Setup) -> Parts<Self> {
        let (contact, link) = (contact::Named::default(), link::Named::default());
        Parts { sensor: Sensor::new(&setup.array), contact, drive: Drive::new(setup), link }
    }
}

impl Set for Reference {
    type Sensor = Sensor;
    type Drive = Drive;

    fn of(scene: &Scene, _finger: usize) -> Parts<Self> {
        Self::parts(&scene.setup())
    }
}

/// Friction, gear and supply.
pub struct Drive {
    pub faults: Faults,
    /// Count of the encoder at the last read.
    pub counts: i32,
    friction_nm: f64,
    load_share: f64,
    source_ohm: f64,
}

impl Drive {
    pub fn new(setup: &Setup) -> Self {
        Self {
            faults: Faults::default(),
            counts: 0,
            friction_nm: setup.motor.friction_nm,
            load_share: 1.0 / setup.transmission.efficiency - 1.0,
            source_ohm: setup.supply.source_ohm,
        }
    }
}

impl drive::Stages for Drive {
    fn none(&self) -> bool {
        false
    }

    fn circuit(&mut self, circuit: &mut Circuit) {
        circuit.source_v -= self.faults.supply_drop_v;
        circuit.source_ohm = self.source_ohm;
        if self.faults.leads_swapped {
            circuit.duty = -circuit.duty;
        }
    }

    fn friction(&mut self, _speed_rad_per_s: f64, friction: &mut Friction) {
        let Self { friction_nm, load_share, .. } = *self;
        *friction = Friction { sliding_nm: friction_nm, holding_nm: friction_nm, load_share, viscous_nm_s: 0.0 };
    }

    fn end_stops_mm(&self) -> Option<[f64; 2]> {
        self.faults.end_stops_mm
    }

    fn count(&mut self, count: i32) -> i32 {
        if !self.faults.encoder_frozen {
            self.counts = if self.faults.encoder_reversed { -count } else { count };
        }
        self.counts
    }
}

/// Characteristic of the taxels, row switches and settling.
pub struct Sensor {
    pub faults: ArrayFaults,
    array: Array,
    settling: Settling,
    /// Voltage that each row adds to the columns while it is driven.
    rows: [sensor::Row; ROWS],
}

impl Sensor {
    pub fn new(array: &Array) -> Self {
        Self {
            faults: ArrayFaults::default(),
            array: *array,
            settling: Settling::new(array.settle_tau_s, array.sample_after_s),
            rows: [[0.0; COLUMNS]; ROWS],
        }
    }
}

impl sensor::Stages for Sensor {
    fn none(&self) -> bool {
        false
    }

    fn conductance(&mut self, row: usize, _time_s: f64, siemens: &mut sensor::Row) {
        for (siemens, taxel) in siemens.iter_mut().zip(self.faults.taxels[row]) {
            *siemens = match taxel {
                Taxel::Sound => self.array.loaded(*siemens),
                Taxel::Dead => 0.0,
                Taxel::Shorted => self.array.short_siemens,
            };
        }
    }

    fn network(&mut self, row: usize, _array: &[sensor::Row; ROWS], seen: &mut sensor::Row) {
        let left = 1.0 + self.array.row_ohm * seen.iter().sum::<f64>();
        seen.iter_mut().for_each(|siemens| *siemens /= left);
        self.rows[row] = seen.map(|siemens| siemens * self.array.feedback_ohm * self.array.drive_v);
    }

    fn volts(&mut self, slot: usize, time_s: f64, volts: &mut sensor::Row) {
        for (row, (state, added)) in self.faults.rows.iter().zip(&self.rows).enumerate() {
            let sign = match state {
                Row::StuckHigh if row != slot => 1.0,
                Row::StuckLow if row == slot => -1.0,
                _ => continue,
            };
            volts.iter_mut().zip(added).for_each(|(volts, added)| *volts += sign * added);
        }
        let reference_v = self.array.reference_v;
        *volts = volts.map(|volts| if self.faults.saturated { reference_v } else { volts.min(reference_v) });
        self.settling.sample(time_s, volts);
    }
}
