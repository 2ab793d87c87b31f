//! What can be wrong with the array.

use fingertip::shipped::{COLUMNS, ROWS};
use serde::{Deserialize, Serialize};
use sim::setup::Array;

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
    pub fn driven(&self, asked: &[bool; ROWS]) -> [bool; ROWS] {
        core::array::from_fn(|row| match self.rows[row] {
            Row::Sound => asked[row],
            Row::StuckHigh => true,
            Row::StuckLow => false,
        })
    }

    /// Conductance of a taxel under a pressure.
    pub fn siemens(&self, array: &Array, row: usize, column: usize, pressure_kpa: f64) -> f64 {
        match self.taxels[row][column] {
            Taxel::Sound => array.loaded(array.preload_siemens + array.siemens_per_kpa * pressure_kpa),
            Taxel::Dead => 0.0,
            Taxel::Shorted => array.short_siemens,
        }
    }
}
