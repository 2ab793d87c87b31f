//! The plant: the reference finger of `docs/board.md` with its array, moved by hand.
//!
//! It is a scene's finger and the same world, but what a scene names by its effects is part of it ([`Setup`]), it can
//! be broken while it runs ([`Faults`]), its rows are driven pin by pin, and a snapshot by serde restores every bit.
//!
//! ```
//! use sim::bridge::Bridge;
//! use sim::plant::{Plant, Setup};
//!
//! let mut plant = Plant::new(&Setup::default());
//! while plant.force_n() < 1.0 {
//!     plant.advance(10e-6, Bridge::Driven { duty: 0.3 });
//! }
//! assert!(plant.pressure_kpa(5, 5) > 0.0);
//! ```

mod parts;

pub use crate::setup::Setup;
pub use parts::{Drive, Reference, Sensor};

use crate::bridge::Bridge;
use crate::effects::sensor::Readout;
use crate::mechanics::body::Surroundings;
use crate::mechanics::decay::decay;
use crate::mechanics::finger::{Finger, Motion};
use crate::mechanics::rotor::Shaft;
use crate::world::World;
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use serde::{Deserialize, Serialize};

/// The finger and its array at one instant.
#[derive(Serialize, Deserialize)]
#[serde(from = "Kept", into = "Kept")]
pub struct Plant {
    /// Defects; may be changed at any time.
    pub faults: Faults,
    world: World<Reference>,
    sensor: Sensor,
    readout: Readout,
}

/// What a snapshot keeps: all else follows from it.
#[derive(Serialize, Deserialize)]
struct Kept {
    setup: Setup,
    faults: Faults,
    motion: Motion,
    counts: i32,
}

impl Plant {
    /// At rest at travel 0, the bridge open.
    pub fn new(setup: &Setup) -> Self {
        let world = World::new(setup, &Surroundings::default(), vec![(Drive::new(setup), ())]);
        let (sensor, readout) = (Sensor::new(&setup.array), Readout::new(&setup.array));
        Self { faults: Faults::default(), world, sensor, readout }
    }

    fn finger(&self) -> &Finger<Drive, ()> {
        &self.world.fingers()[0]
    }

    fn finger_mut(&mut self) -> &mut Finger<Drive, ()> {
        &mut self.world.fingers_mut()[0]
    }

    /// What it is made of.
    pub fn setup(&self) -> &Setup {
        self.finger().setup()
    }

    /// Puts the object where the tip meets it at this travel.
    pub fn place_object(&mut self, distance_mm: f64) {
        self.finger_mut().place_object(distance_mm);
    }

    /// One step with the bridge held; 10 us is the step that the tests vouch for.
    pub fn advance(&mut self, dt_s: f64, bridge: Bridge) {
        self.finger_mut().drive.faults = self.faults;
        self.world.advance(0.0, dt_s, &[bridge]);
        // A count that is frozen stands as it was read last.
        self.finger_mut().count_ahead(0.0);
    }

    /// Puts the tip at rest at a travel, as if carried there.
    pub fn place(&mut self, travel_mm: f64) {
        self.finger_mut().place(travel_mm);
        self.advance(0.0, Bridge::Coast);
    }

    /// Angle and speed of the motor.
    pub fn shaft(&self) -> Shaft {
        self.finger().shaft()
    }

    /// How far the tip has come.
    pub fn travel_mm(&self) -> f64 {
        self.finger().tip_mm()
    }

    /// Speed of the tip.
    pub fn speed_mm_per_s(&self) -> f64 {
        self.finger().speed_mm_per_s()
    }

    /// Indentation of the tip; 0 without contact.
    pub fn indentation_mm(&self) -> f64 {
        (self.travel_mm() - self.setup().wall.distance_mm).max(0.0)
    }

    /// The true contact force.
    pub fn force_n(&self) -> f64 {
        self.world.force_n(0)
    }

    /// Current in the winding, averaged over the PWM.
    pub fn current_a(&self) -> f64 {
        self.finger().current_a()
    }

    /// The supply at the bridge.
    pub fn supply_v(&self) -> f64 {
        self.finger().supply_v()
    }

    /// What the timer in encoder mode has counted, unwrapped.
    pub fn encoder_counts(&self) -> i32 {
        self.finger().drive.counts
    }

    /// What the control step learns beside the frame.
    pub fn sense(&mut self, bus_silent_ms: u16) -> Sense {
        self.world.sense(0, bus_silent_ms)
    }

    /// Mean pressure on a taxel.
    ///
    /// # Panics
    /// On a row or column beyond the array, as everything below that takes one.
    pub fn pressure_kpa(&mut self, row: usize, column: usize) -> f64 {
        self.world.row_kpa(0, f64::INFINITY, row)[column]
    }

    /// All columns' voltages at a time after the rows changed from `previous`, settled until then, to `driven`.
    pub fn settling_volts(
        &mut self,
        driven: &[bool; ROWS],
        since_edge_s: f64,
        previous: &[bool; ROWS],
    ) -> [f64; COLUMNS] {
        let left = decay(since_edge_s / self.setup().array.settle_tau_s);
        let end = self.settled_volts(driven);
        if left == 0.0 || driven == previous {
            return end;
        }
        let start = self.settled_volts(previous);
        core::array::from_fn(|column| end[column] + left * (start[column] - end[column]))
    }

    /// All columns' voltages long after these rows were driven.
    pub fn settled_volts(&mut self, driven: &[bool; ROWS]) -> [f64; COLUMNS] {
        let (array, faults) = (self.setup().array, self.faults.array);
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

    /// The whole frame at this instant; counts its sequence number on.
    pub fn fill_frame(&mut self, frame: &mut Frame) {
        for slot in 0..SLOTS {
            for (column, code) in self.slot_codes(slot).into_iter().enumerate() {
                frame.set_code(slot, column, code);
            }
        }
        frame.sequence = frame.sequence.wrapping_add(1);
    }

    /// The codes of a slot's columns, sampled [`crate::setup::Array::sample_after_s`] after the slot's edge.
    pub fn slot_codes(&mut self, slot: usize) -> [u16; COLUMNS] {
        let array = self.setup().array;
        let previous = driven_in((slot + SLOTS - 1) % SLOTS);
        self.settling_volts(&driven_in(slot), array.sample_after_s, &previous).map(|volts| array.code(volts))
    }
}

/// The rows driven in a slot of the scan: one, or none in the last.
fn driven_in(slot: usize) -> [bool; ROWS] {
    core::array::from_fn(|row| row == slot)
}

impl From<&Plant> for Kept {
    fn from(plant: &Plant) -> Self {
        let finger = plant.finger();
        Self {
            setup: finger.setup().clone(),
            faults: plant.faults,
            motion: finger.motion(),
            counts: finger.drive.counts,
        }
    }
}

impl From<Plant> for Kept {
    fn from(plant: Plant) -> Self {
        Self::from(&plant)
    }
}

impl From<Kept> for Plant {
    fn from(kept: Kept) -> Self {
        let mut plant = Self::new(&kept.setup);
        plant.faults = kept.faults;
        let finger = plant.finger_mut();
        finger.resume(&kept.motion);
        finger.drive.counts = kept.counts;
        plant
    }
}

impl Clone for Plant {
    fn clone(&self) -> Self {
        Kept::from(self).into()
    }
}

impl core::fmt::Debug for Plant {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Plant").field("faults", &self.faults).finish_non_exhaustive()
    }
}

/// What can be wrong with a taxel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Taxel {
    /// Nothing.
    #[default]
    Sound,
    /// An open circuit: no preload, no pressure.
    Dead,
    /// A short circuit.
    Shorted,
}

/// What can be wrong with a row's switch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Row {
    /// Nothing.
    #[default]
    Sound,
    /// Stuck in the driven state (its pin high).
    StuckHigh,
    /// Never driven (its pin low).
    StuckLow,
}

/// The array's defects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArrayFaults {
    /// `taxels[row][column]`.
    pub taxels: [[Taxel; COLUMNS]; ROWS],
    /// The row switches.
    pub rows: [Row; ROWS],
    /// All amplifiers at their upper rail.
    pub saturated: bool,
}

impl ArrayFaults {
    /// Which rows are driven in fact when these are asked for.
    fn driven(&self, asked: &[bool; ROWS]) -> [bool; ROWS] {
        core::array::from_fn(|row| match self.rows[row] {
            Row::Sound => asked[row],
            Row::StuckHigh => true,
            Row::StuckLow => false,
        })
    }
}

/// What is wrong with the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Faults {
    /// The array's defects.
    pub array: ArrayFaults,
    /// The encoder's count stands still.
    pub encoder_frozen: bool,
    /// The encoder's channels are swapped: it counts down as the tip presses in.
    pub encoder_reversed: bool,
    /// The motor's leads are swapped: a positive duty draws the tip back.
    pub leads_swapped: bool,
    /// Travels at which the finger meets an end stop, rear and front.
    pub end_stops_mm: Option<[f64; 2]>,
    /// Taken from the source's voltage.
    pub supply_drop_v: f64,
}
