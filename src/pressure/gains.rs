//! A gain for each taxel, as it is sent and stored.

use super::{GAIN_MAX, GAIN_ONE};

/// A gain for each taxel, `gains[row][column]`, Q14: [`GAIN_ONE`] is 1. From a half to just below 2.
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
    /// The least gain: a half.
    pub const MIN: u16 = GAIN_ONE / 2;
    /// The largest.
    pub const MAX: u16 = GAIN_MAX;
    /// All taxels alike.
    pub const ONE: Self = Self([[GAIN_ONE; COLUMNS]; ROWS]);
    /// Words of 32 bits that hold them, two in each.
    pub const WORDS: usize = (ROWS * COLUMNS).div_ceil(2);

    /// By row and column.
    pub const fn rows(&self) -> &[[u16; COLUMNS]; ROWS] {
        &self.0
    }

    /// Of a taxel, row by row; 1 where there is none.
    pub fn get(&self, place: usize) -> u16 {
        self.0.as_flattened().get(place).copied().unwrap_or(GAIN_ONE)
    }

    /// Sets a taxel's, row by row; false where there is no such taxel, or no such gain.
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

    /// Two taxels in a word, the first one in its low half; of an odd number the last half is a gain of 1.
    pub fn word(&self, word: usize) -> u32 {
        u32::from(self.get(2 * word)) | u32::from(self.get(2 * word + 1)) << 16
    }

    /// The inverse of [`Gains::word`]; false where one of them cannot be.
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
