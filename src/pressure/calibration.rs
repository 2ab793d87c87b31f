//! What is known of each taxel beforehand: its gain, and whether to leave it out.

use super::row::weight;
use super::{GAIN_MAX, GAIN_ONE};
use crate::frame::{BANK_COLUMNS, COLUMNS, ROWS};
use lanes::Pairs;

/// All columns of a row.
const ALL: u16 = (1 << COLUMNS) - 1;

/// A calibration that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationError {
    /// The gain of `taxels[row][column]`, Q14, is not within 1 to [`GAIN_MAX`].
    Gain {
        /// The taxel's row.
        row: usize,
        /// The taxel's column.
        column: usize,
        /// What was asked for.
        value: u16,
    },
    /// The mask of a row has bits beyond its ten columns.
    Mask {
        /// The row.
        row: usize,
        /// What was asked for.
        value: u16,
    },
}

impl core::fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Gain { row, column, value } => {
                write!(f, "gain of {value}/{GAIN_ONE} for row {row}, column {column}: 1 to {GAIN_MAX} are allowed")
            }
            Self::Mask { row, value } => write!(f, "mask of {value:#x} for row {row}: 0 to {ALL:#x} are allowed"),
        }
    }
}

impl core::error::Error for CalibrationError {}

/// Gains of all taxels, and a mask of those that are left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Calibration {
    pub(super) weights: [Weights; ROWS],
    /// A bit for each column that is left out.
    pub(super) mask: [u16; ROWS],
}

/// The gains of a row in Q14, and the gains times twice the column's distance from the middle, -9, -7 .. 9, in Q10: at most 18 in 16 bits.
/// In pairs like the codes of a frame; zero where the taxel is left out.
type Weights = [Pairs; 2];

const fn weights(gains: &[u16; COLUMNS]) -> Weights {
    let mut weights = [[0; BANK_COLUMNS]; 2];
    let mut place = 0;
    while place < BANK_COLUMNS {
        let (left, right) = (gains[place] as i32, gains[place + BANK_COLUMNS] as i32);
        // Rounded from Q14.
        let weighted_left = (left * weight(place) + 8) >> 4;
        let weighted_right = (right * weight(place + BANK_COLUMNS) + 8) >> 4;
        weights[0][place] = lanes::pair(left as i16, right as i16);
        weights[1][place] = lanes::pair(weighted_left as i16, weighted_right as i16);
        place += 1;
    }
    weights
}

impl Calibration {
    /// Gains of one, and every taxel counts.
    pub const NONE: Self = Self { weights: [weights(&[GAIN_ONE; COLUMNS]); ROWS], mask: [0; ROWS] };

    /// Takes gains in Q14 (`gains[row][column]`, [`GAIN_ONE`] is 1) and a mask with a bit for each column to leave out.
    ///
    /// # Errors
    /// Names the first taxel or row, its value and its range.
    pub fn new(gains: &[[u16; COLUMNS]; ROWS], mask: &[u16; ROWS]) -> Result<Self, CalibrationError> {
        let mut calibration = Self { mask: *mask, ..Self::NONE };
        for (row, (gains, mask)) in gains.iter().zip(mask).enumerate() {
            if *mask > ALL {
                return Err(CalibrationError::Mask { row, value: *mask });
            }
            for (column, value) in gains.iter().copied().enumerate() {
                if !(1..=GAIN_MAX).contains(&value) {
                    return Err(CalibrationError::Gain { row, column, value });
                }
            }
            let kept = core::array::from_fn(|column| if mask >> column & 1 == 0 { gains[column] } else { 0 });
            calibration.weights[row] = weights(&kept);
        }
        Ok(calibration)
    }
}
