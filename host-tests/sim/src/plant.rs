//! Plant: the reference finger of `docs/board.md` with its array, moved step by step.
//!
//! The plant is a finger in the world of scenes. Its effects are built from its [`Setup`], it can be broken during a run
//! ([`Faults`]), and its rows are driven pin by pin.

pub use crate::setup::Setup;

use crate::effects::drive::{Circuit, Friction};
use crate::effects::sensor::{self, Readout, Settling};
use crate::effects::{Metered, Parts};
use crate::mechanics::{Bridge, Finger, decay};
use crate::world::{Surroundings, World};
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};

/// Finger and its array at one instant.
pub struct Plant {
    /// Defects; may be changed at any time.
    pub faults: Faults,
    world: World,
    sensor: sensor::Named,
    readout: Readout,
}

impl Plant {
    /// Creates a plant at rest at travel 0, with the bridge open.
    pub fn new(setup: &Setup) -> Self {
        let Parts { sensor, contact, drive, .. } = parts(setup);
        let world = World::new(setup, &Surroundings::default(), vec![(drive, contact)]);
        let readout = Readout::new(&setup.array, None);
        Self { faults: Faults::default(), world, sensor, readout }
    }

    pub fn finger(&self) -> &Finger {
        &self.world.fingers[0]
    }

    pub fn finger_mut(&mut self) -> &mut Finger {
        &mut self.world.fingers[0]
    }

    /// Advances by one step with a constant bridge. The tests cover steps of 10 us.
    pub fn advance(&mut self, dt_s: f64, bridge: Bridge) {
        self.finger_mut().faults = self.faults;
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
        self.finger().counts
    }

    /// Returns what the control step receives beside the frame.
    pub fn sense(&mut self, bus_silent_ms: u16) -> Sense {
        self.world.sense(0, bus_silent_ms)
    }

    /// Settled voltages of all columns while these rows are driven.
    ///
    /// # Panics
    /// The row is beyond the array, as in all methods below.
    pub fn settled_volts(&mut self, driven: &[bool; ROWS]) -> [f64; COLUMNS] {
        let (array, faults) = (self.finger().setup.array, self.faults.array);
        if faults.saturated {
            return [array.reference_v; COLUMNS];
        }
        self.readout.faults = Some(faults);
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
        // Only the row of the slot is driven, and none in the last slot.
        let [before, end] =
            [(slot + SLOTS - 1) % SLOTS, slot].map(|slot| self.settled_volts(&core::array::from_fn(|row| row == slot)));
        let left = decay(array.sample_after_s / array.settle_tau_s);
        core::array::from_fn(|column| array.code(end[column] + left * (before[column] - end[column])))
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

/// Effects of the reference finger: friction, gear and supply; characteristic of the taxels, row switches and settling.
pub fn parts(setup: &Setup) -> Parts {
    let (array, source_ohm) = (setup.array, setup.supply.source_ohm);
    let (friction_nm, load_share) = (setup.motor.friction_nm, 1.0 / setup.transmission.efficiency - 1.0);
    let supply = move |circuit: &mut Circuit| circuit.source_ohm += source_ohm;
    let friction = move |_, friction: &mut Friction| {
        friction.sliding_nm += friction_nm;
        friction.holding_nm += friction_nm;
        friction.load_share += load_share;
    };
    let load = move |_, _, siemens: &mut sensor::Row| *siemens = siemens.map(|line| array.loaded(line));
    let sag = move |_, _: &_, seen: &mut sensor::Row| {
        let left = 1.0 + array.row_ohm * seen.iter().sum::<f64>();
        seen.iter_mut().for_each(|siemens| *siemens /= left);
    };
    let mut settling = Settling::new(array.settle_tau_s, array.sample_after_s);
    let settle = move |_, time_s, volts: &mut sensor::Row| {
        *volts = volts.map(|volts| volts.min(array.reference_v));
        settling.sample(time_s, volts);
    };
    let mut parts = Parts::default();
    parts.drive.electric.push(Metered::new(NAME, Box::new(supply)));
    parts.drive.resist.push(Metered::new(NAME, Box::new(friction)));
    parts.sensor.conductance.push(Metered::new(NAME, Box::new(load)));
    parts.sensor.network.push(Metered::new(NAME, Box::new(sag)));
    parts.sensor.volts.push(Metered::new(NAME, Box::new(settle)));
    parts
}

/// Name of the effects of the plant.
const NAME: &str = "plant";
