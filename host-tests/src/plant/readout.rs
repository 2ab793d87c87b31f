//! From pressures to the columns' voltages and codes: zero-potential readout, its row sag, its settling and its
//! defects.

use super::setup::Array;
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

impl Array {
    /// The conductance where one on the line would be so large: a parabola through it, solved.
    fn loaded(&self, line: f64) -> f64 {
        if self.growth == 0.0 {
            return line;
        }
        // As a share of the converter's full range.
        let range = self.reference_v / (self.feedback_ohm * self.drive_v);
        2.0 * line / (1.0 + (1.0 + 4.0 * self.growth * line / range).sqrt())
    }

    /// What a driven row of these conductances adds to each column's voltage: R_f G V_drive / (1 + R_on S).
    pub fn row_volts(&self, siemens: &[f64; COLUMNS]) -> [f64; COLUMNS] {
        let scale = self.feedback_ohm * self.drive_v / (1.0 + self.row_ohm * siemens.iter().sum::<f64>());
        siemens.map(|g| g * scale)
    }

    /// The code of a voltage: rounded down, as a successive-approximation converter does.
    pub fn code(&self, volts: f64) -> u16 {
        (volts / self.reference_v * Self::CODES).floor().clamp(0.0, Self::CODES - 1.0) as u16
    }
}

/// exp(-x) for x of 0 or more, from the four operations alone, so that every machine gives the same bits.
///
/// The diagonal Pade approximant of order 3 at x/1024, squared ten times: relative error below 1e-12 up to x = 12,
/// below 1e-11 up to x = 40; 0 above.
pub fn decay(x: f64) -> f64 {
    if x > 40.0 {
        return 0.0;
    }
    let y = x.max(0.0) / 1024.0;
    let (even, odd) = (1.0 + y * y / 10.0, y / 2.0 + y * y * y / 120.0);
    let mut power = (even - odd) / (even + odd);
    for _ in 0..10 {
        power *= power;
    }
    power
}
