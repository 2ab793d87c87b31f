//! Calibration of each taxel: its gain, and a mask of taxels to leave out.

use super::{GAIN_BITS, GAIN_MAX, GAIN_ONE, weight};
use lanes::place;

/// Mask of all columns of a row.
pub(super) const fn all(columns: usize) -> u32 {
    u32::MAX >> (u32::BITS - columns as u32)
}

/// Reason to refuse a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CalibrationError {
    /// The gain of `taxels[row][column]`, Q14, is not within 1 to [`GAIN_MAX`].
    Gain {
        /// The taxel's row.
        row: usize,
        /// The taxel's column.
        column: usize,
        /// Requested value.
        value: u16,
    },
    /// The mask of a row has bits beyond its columns.
    Mask {
        /// The row.
        row: usize,
        /// Requested value.
        value: u32,
        /// Largest mask that is allowed.
        all: u32,
    },
}

impl core::fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Gain { row, column, value } => {
                write!(f, "gain of {value}/{GAIN_ONE} for row {row}, column {column}: 1 to {GAIN_MAX} are allowed")
            }
            Self::Mask { row, value, all } => write!(f, "mask of {value:#x} for row {row}: 0 to {all:#x} are allowed"),
        }
    }
}

impl core::error::Error for CalibrationError {}

/// Gains of all taxels, and a mask of taxels to leave out.
///
/// ```
/// use fingertip::pressure::{Calibration, GAIN_ONE};
///
/// let mut gains = [[GAIN_ONE; 4]; 4];
/// gains[1][2] = GAIN_ONE + GAIN_ONE / 10; // reads 10 % too little
/// let calibration = Calibration::new(&gains, &[0, 0, 0, 0b1000]).unwrap(); // the last taxel is broken
/// assert!(Calibration::new(&[[0; 4]; 4], &[0; 4]).is_err());
/// # let _ = calibration;
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Calibration<const ROWS: usize, const COLUMNS: usize> {
    pub(super) weights: [Weights<COLUMNS>; ROWS],
    /// Bits of the columns that are left out, for each row.
    pub(super) mask: [u32; ROWS],
}

/// Gains of a row in Q14, and the gains times twice the column's distance from the middle, -9, -7 .. 9 of ten, with
/// [`lanes::moment_bits`]: both in 16 bits. In the order of a frame's codes; zero for a taxel that is left out.
type Weights<const COLUMNS: usize> = [[i16; COLUMNS]; 2];

const fn weights<const COLUMNS: usize>(gains: &[u16; COLUMNS]) -> Weights<COLUMNS> {
    let drop = GAIN_BITS - lanes::moment_bits(COLUMNS);
    let mut weights = [[0; COLUMNS]; 2];
    let mut column = 0;
    while column < COLUMNS {
        let gain = gains[column] as i32;
        weights[0][place(column, COLUMNS)] = gain as i16;
        // Rounded from Q14.
        let weighted = (gain * weight(column, COLUMNS) + (1 << (drop - 1))) >> drop;
        weights[1][place(column, COLUMNS)] = weighted as i16;
        column += 1;
    }
    weights
}

impl<const ROWS: usize, const COLUMNS: usize> Calibration<ROWS, COLUMNS> {
    /// Calibration with gains of one and no taxel left out.
    pub const NONE: Self = Self { weights: [weights(&[GAIN_ONE; COLUMNS]); ROWS], mask: [0; ROWS] };

    /// Calibration with these gains and no taxel left out.
    pub fn of(gains: &Gains<ROWS, COLUMNS>) -> Self {
        let mut calibration = Self::NONE;
        calibration.weights.iter_mut().zip(gains.rows()).for_each(|(to, gains)| *to = weights(gains));
        calibration
    }

    /// Takes gains in Q14 (`gains[row][column]`, [`GAIN_ONE`] is 1) and a mask with a bit for each column to leave out.
    ///
    /// # Errors
    /// Names the first taxel or row, its value and its range.
    pub fn new(gains: &[[u16; COLUMNS]; ROWS], mask: &[u32; ROWS]) -> Result<Self, CalibrationError> {
        let mut calibration = Self { mask: *mask, ..Self::NONE };
        for (row, (gains, mask)) in gains.iter().zip(mask).enumerate() {
            if *mask > all(COLUMNS) {
                return Err(CalibrationError::Mask { row, value: *mask, all: all(COLUMNS) });
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

/// Gain of each taxel, `gains[row][column]`, Q14: [`GAIN_ONE`] is 1. From a half to just below 2. A host sends them,
/// and the flash stores them.
///
/// ```
/// use fingertip::pressure::GAIN_ONE;
/// use fingertip::shipped::Gains;
///
/// let mut gains = Gains::ONE;
/// assert!(gains.set(12, GAIN_ONE + GAIN_ONE / 10)); // row 1, column 2 reads 10 % too little
/// assert!(!gains.set(12, 1)); // out of range
/// assert_eq!(gains.get(12), 18_022);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gains<const ROWS: usize, const COLUMNS: usize>([[u16; COLUMNS]; ROWS]);

impl<const ROWS: usize, const COLUMNS: usize> Gains<ROWS, COLUMNS> {
    /// Least gain: a half.
    pub const MIN: u16 = GAIN_ONE / 2;
    /// Largest gain.
    pub const MAX: u16 = GAIN_MAX;
    /// Gains of one.
    pub const ONE: Self = Self([[GAIN_ONE; COLUMNS]; ROWS]);
    /// Number of words of 32 bits that hold the gains, two in each.
    pub const WORDS: usize = (ROWS * COLUMNS).div_ceil(2);

    /// Gains by row and column.
    pub const fn rows(&self) -> &[[u16; COLUMNS]; ROWS] {
        &self.0
    }

    /// Gain of a taxel, counted row by row; 1 out of range.
    pub fn get(&self, place: usize) -> u16 {
        self.0.as_flattened().get(place).copied().unwrap_or(GAIN_ONE)
    }

    /// Sets the gain of a taxel, counted row by row. Returns false if there is no such taxel, or no such gain.
    pub fn set(&mut self, place: usize, gain: u16) -> bool {
        let allowed = (Self::MIN..=Self::MAX).contains(&gain);
        match self.0.as_flattened_mut().get_mut(place) {
            Some(own) if allowed => {
                *own = gain;
                true
            }
            _ => false,
        }
    }

    /// Gains of two taxels in a word, the first one in its low half. With an odd number of taxels the last half is a
    /// gain of 1.
    pub fn word(&self, word: usize) -> u32 {
        u32::from(self.get(2 * word)) | u32::from(self.get(2 * word + 1)) << 16
    }

    /// Sets two gains from a word, the inverse of [`Gains::word`]. Returns false if one of them cannot be.
    pub fn set_word(&mut self, word: usize, value: u32) -> bool {
        let last = 2 * word + 1 == ROWS * COLUMNS;
        let high = (value >> 16) as u16;
        self.set(2 * word, value as u16) && if last { high == GAIN_ONE } else { self.set(2 * word + 1, high) }
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Gains<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_hold_all_gains_also_of_an_odd_number() {
        let mut gains = Gains::<3, 5>::ONE;
        for place in 0..15 {
            assert!(gains.set(place, 8_192 + 1_000 * place as u16), "{place}");
        }
        let mut back = Gains::<3, 5>::ONE;
        for word in 0..Gains::<3, 5>::WORDS {
            assert!(back.set_word(word, gains.word(word)));
        }
        assert_eq!(back, gains);
        assert!(!back.set_word(7, gains.word(7) ^ 1 << 16), "there is no taxel");
        assert!(!back.set_word(8, gains.word(0)));
    }

    #[test]
    fn what_cannot_be_is_refused_and_changes_nothing() {
        let mut gains = Gains::<10, 10>::ONE;
        for (place, gain) in [(0, 8_191), (0, 32_768), (99, 0), (100, GAIN_ONE), (usize::MAX, GAIN_ONE)] {
            assert!(!gains.set(place, gain), "{gain} at {place}");
        }
        assert_eq!(gains, Gains::ONE);
        assert!(gains.set(0, 8_192) && gains.set(99, 32_767));
    }
}
