//! The simulated board around the microcontroller: soft fingertip, tactile array, motor, encoder, supply, wall.
//!
//! In f64, from + - * / and sqrt alone, so that every machine gives the same bits. Equations and sources stand in
//! `docs/plant.md`. All of it is simulated; nothing here has touched silicon.
//!
//! ```
//! use host_tests::plant::{Bridge, Setup, World};
//!
//! let mut world = World::new(&Setup::default());
//! while world.force_n() < 1.0 {
//!     world.advance(10e-6, Bridge::Driven { duty: 0.3 });
//! }
//! assert!(world.pressure_kpa(5, 5) > 0.0);
//! ```

pub mod readout;
mod rows;

pub use readout::{ArrayFaults, Row, Taxel};
pub use sim::bridge::Bridge;
pub use sim::setup::Setup;

use core::f64::consts::TAU;
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use fingertip::units::CoreCycles;
use serde::{Deserialize, Serialize};
use sim::mechanics::decay::decay;
use sim::mechanics::dynamics::Dynamics;
use sim::mechanics::rotor::{Shaft, Source};

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

/// The board and the world at one instant. A snapshot by serde restores every bit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct World {
    setup: Setup,
    /// Defects; may be changed at any time.
    pub faults: Faults,
    shaft: Shaft,
    bridge: Bridge,
    counts: i32,
    #[serde(skip)]
    rows: rows::Rows,
}

impl World {
    /// At rest at travel 0, the bridge open.
    pub fn new(setup: &Setup) -> Self {
        Self {
            setup: setup.clone(),
            faults: Faults::default(),
            shaft: Shaft::default(),
            bridge: Bridge::Coast,
            counts: 0,
            rows: rows::Rows::default(),
        }
    }

    /// What it is made of.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// What it is made of, to move the wall or wear a part while it runs.
    pub fn setup_mut(&mut self) -> &mut Setup {
        &mut self.setup
    }

    /// One integrator step with the bridge held; 10 us is the step that the tests vouch for.
    pub fn advance(&mut self, dt_s: f64, bridge: Bridge) {
        self.bridge = match bridge {
            Bridge::Driven { duty } if self.faults.leads_swapped => Bridge::Driven { duty: -duty },
            sound => sound,
        };
        self.shaft = Dynamics::new(&self.setup).advance(self.shaft, dt_s, &self.source());
        if let Some(ends_mm) = self.faults.end_stops_mm {
            self.stop_at(ends_mm);
        }
        if !self.faults.encoder_frozen {
            let turns = self.shaft.angle_rad / TAU;
            let counts = (turns * self.setup.motor.encoder_counts_per_turn).floor() as i32;
            self.counts = if self.faults.encoder_reversed { -counts } else { counts };
        }
    }

    /// Holds the tip where it meets an end.
    fn stop_at(&mut self, [rear_mm, front_mm]: [f64; 2]) {
        let travel_mm = self.travel_mm();
        let held_mm = travel_mm.clamp(rear_mm, front_mm);
        if held_mm != travel_mm {
            self.shaft = Shaft { angle_rad: Dynamics::new(&self.setup).angle_rad(held_mm), speed_rad_per_s: 0.0 };
        }
    }

    /// Puts the tip at rest at a travel, as if carried there.
    pub fn place(&mut self, travel_mm: f64) {
        self.shaft = Shaft { angle_rad: Dynamics::new(&self.setup).angle_rad(travel_mm), speed_rad_per_s: 0.0 };
        self.advance(0.0, Bridge::Coast);
    }

    /// Angle and speed of the motor.
    pub fn shaft(&self) -> Shaft {
        self.shaft
    }

    /// How far the tip has come.
    pub fn travel_mm(&self) -> f64 {
        Dynamics::new(&self.setup).travel_mm(self.shaft.angle_rad)
    }

    /// Speed of the tip.
    pub fn speed_mm_per_s(&self) -> f64 {
        Dynamics::new(&self.setup).travel_mm(self.shaft.speed_rad_per_s)
    }

    /// Indentation of the tip; 0 without contact.
    pub fn indentation_mm(&self) -> f64 {
        (self.travel_mm() - self.setup.wall.distance_mm).max(0.0)
    }

    /// The true contact force.
    pub fn force_n(&self) -> f64 {
        self.setup.tip.force_n(self.indentation_mm())
    }

    /// Current in the winding, averaged over the PWM.
    pub fn current_a(&self) -> f64 {
        Dynamics::new(&self.setup).current_a(&self.source(), self.shaft.speed_rad_per_s)
    }

    /// The supply at the bridge.
    pub fn supply_v(&self) -> f64 {
        self.source_v() - self.setup.supply.source_ohm * self.duty() * self.current_a()
    }

    /// What the timer in encoder mode has counted, unwrapped.
    pub fn encoder_counts(&self) -> i32 {
        self.counts
    }

    /// What the control step learns beside the frame.
    pub fn sense(&self, bus_silent_ms: u16) -> Sense {
        let supply_mv = (self.supply_v() * 1e3 + 0.5).clamp(0.0, f64::from(u16::MAX)) as u16;
        Sense { encoder: self.counts, supply_mv, bus_silent_ms, bridge_fault: false, answer: CoreCycles(0) }
    }

    /// Mean pressure on a taxel.
    ///
    /// # Panics
    /// On a row or column beyond the array, as everything below that takes one.
    pub fn pressure_kpa(&mut self, row: usize, column: usize) -> f64 {
        let indentation_mm = self.indentation_mm();
        self.rows.row_kpa(&self.setup, indentation_mm, row)[column]
    }

    /// A column's voltage at a time after the rows changed from `previous`, settled until then, to `driven`.
    pub fn column_volts(
        &mut self,
        driven: &[bool; ROWS],
        column: usize,
        since_edge_s: f64,
        previous: &[bool; ROWS],
    ) -> f64 {
        self.settling_volts(driven, since_edge_s, previous)[column]
    }

    /// All columns' voltages at a time after the rows changed from `previous`, settled until then, to `driven`.
    pub fn settling_volts(
        &mut self,
        driven: &[bool; ROWS],
        since_edge_s: f64,
        previous: &[bool; ROWS],
    ) -> [f64; COLUMNS] {
        let array = self.setup.array;
        let left = decay(since_edge_s / array.settle_tau_s);
        let end = self.settled_volts(driven);
        if left == 0.0 || driven == previous {
            return end;
        }
        let start = self.settled_volts(previous);
        core::array::from_fn(|column| end[column] + left * (start[column] - end[column]))
    }

    /// All columns' voltages long after these rows were driven.
    pub fn settled_volts(&mut self, driven: &[bool; ROWS]) -> [f64; COLUMNS] {
        let array = self.setup.array;
        let faults = self.faults.array;
        let mut volts = [array.ground_v; COLUMNS];
        if faults.saturated {
            return [array.reference_v; COLUMNS];
        }
        let indentation_mm = self.indentation_mm();
        for (row, _) in faults.driven(driven).iter().enumerate().filter(|(_, driven)| **driven) {
            let pressures = self.rows.row_kpa(&self.setup, indentation_mm, row);
            let siemens = core::array::from_fn(|column| faults.siemens(&array, row, column, pressures[column]));
            for (sum, part) in volts.iter_mut().zip(array.row_volts(&siemens)) {
                *sum += part;
            }
        }
        volts.map(|v| v.min(array.reference_v))
    }

    /// The code of a column in a slot of the scan, sampled [`setup::Array::sample_after_s`] after the slot's edge.
    pub fn code(&mut self, slot: usize, column: usize) -> u16 {
        self.slot_codes(slot)[column]
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

    /// The codes of a slot's columns.
    pub fn slot_codes(&mut self, slot: usize) -> [u16; COLUMNS] {
        let array = self.setup.array;
        let previous = driven_in((slot + SLOTS - 1) % SLOTS);
        self.settling_volts(&driven_in(slot), array.sample_after_s, &previous).map(|volts| array.code(volts))
    }

    fn source_v(&self) -> f64 {
        self.setup.supply.source_v - self.faults.supply_drop_v
    }

    fn duty(&self) -> f64 {
        match self.bridge {
            Bridge::Coast => 0.0,
            Bridge::Driven { duty } => duty.clamp(-1.0, 1.0),
        }
    }

    fn source(&self) -> Source {
        match self.bridge {
            Bridge::Coast => Source::OPEN,
            Bridge::Driven { .. } => {
                let duty = self.duty();
                let ohms = self.setup.supply.circuit_ohm(&self.setup.motor, duty);
                Source { volts: duty * self.source_v(), ohms, ..Source::OPEN }
            }
        }
    }
}

/// The rows driven in a slot of the scan: one, or none in the last.
fn driven_in(slot: usize) -> [bool; ROWS] {
    core::array::from_fn(|row| row == slot)
}
