//! The reference finger's losses and its array's, with what can break: the effects of a plant.

use super::{ArrayFaults, Faults, Row, Taxel};
use crate::effects::drive::{self, Circuit, Friction};
use crate::effects::sensor;
use crate::effects::sensor::readout::Settling;
use crate::effects::set::{Parts, Set};
use crate::scene::{Scene, controller};
use crate::setup::{Array, Setup};
use crate::watch::Cost;
use fingertip::shipped::{COLUMNS, ROWS};

/// The effects of the reference finger, which may break while it runs.
pub struct Reference;

impl Reference {
    /// Of a setup.
    pub fn parts(setup: &Setup) -> Parts<Self> {
        Parts { sensor: Sensor::new(&setup.array), contact: (), drive: Drive::new(setup), link: () }
    }
}

impl Set for Reference {
    type Sensor = Sensor;
    type Contact = ();
    type Drive = Drive;
    type Link = ();

    fn of(scene: &Scene, _finger: usize) -> Parts<Self> {
        Self::parts(&controller::setup(scene))
    }

    fn costs(_sensor: &Sensor, _contact: &(), _drive: &Drive, _link: &()) -> Vec<Cost> {
        Vec::new()
    }
}

/// Friction, gear and supply.
pub struct Drive {
    /// Defects.
    pub faults: Faults,
    /// What the encoder counted when it was read last.
    pub counts: i32,
    friction_nm: f64,
    load_share: f64,
    source_ohm: f64,
}

impl Drive {
    /// Sound.
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

/// Characteristic, row switches and settling.
pub struct Sensor {
    /// Defects.
    pub faults: ArrayFaults,
    array: Array,
    settling: Settling,
    /// What each row adds to the columns where it is driven, V.
    rows: [sensor::Row; ROWS],
}

impl Sensor {
    /// Sound.
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
