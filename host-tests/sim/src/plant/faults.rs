//! What can be wrong with a plant.

use fingertip::shipped::{COLUMNS, ROWS};
use serde::{Deserialize, Serialize};

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
    pub(super) fn driven(&self, asked: &[bool; ROWS]) -> [bool; ROWS] {
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
