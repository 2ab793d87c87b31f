//! What is known of each taxel beforehand: its gain, and whether to leave it out.

use super::{GAIN_MAX, GAIN_ONE};
use crate::frame::{BANK_COLUMNS, COLUMNS, ROWS};

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
    /// Q14, in pairs like the codes of a frame; zero where the taxel is left out.
    pub(super) gain: [[u32; BANK_COLUMNS]; ROWS],
    /// A bit for each column that is left out.
    pub(super) mask: [u16; ROWS],
}

impl Calibration {
    /// Gains of one, and every taxel counts.
    pub const NONE: Self =
        Self { gain: [[lanes::pair(GAIN_ONE as i16, GAIN_ONE as i16); BANK_COLUMNS]; ROWS], mask: [0; ROWS] };

    /// Takes gains in Q14 (`gains[row][column]`, [`GAIN_ONE`] is 1) and a mask with a bit for each column to leave out.
    ///
    /// # Errors
    /// Names the first taxel or row, its value and its range.
    pub fn new(gains: &[[u16; COLUMNS]; ROWS], mask: &[u16; ROWS]) -> Result<Self, CalibrationError> {
        let mut calibration = Self::NONE;
        for (row, (gains, mask)) in gains.iter().zip(mask).enumerate() {
            if *mask > ALL {
                return Err(CalibrationError::Mask { row, value: *mask });
            }
            for (column, value) in gains.iter().copied().enumerate() {
                if !(1..=GAIN_MAX).contains(&value) {
                    return Err(CalibrationError::Gain { row, column, value });
                }
            }
            let kept = |column: usize| if mask >> column & 1 == 0 { gains[column] as i16 } else { 0 };
            calibration.gain[row] = core::array::from_fn(|place| lanes::pair(kept(place), kept(place + BANK_COLUMNS)));
        }
        calibration.mask = *mask;
        Ok(calibration)
    }
}
