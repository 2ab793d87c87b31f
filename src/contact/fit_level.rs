//! How much work the loop puts into the contact of each frame.

/// How much work the loop puts into the contact of each frame. The numbers are stable: hosts store them.
///
/// A refinement of the model takes each row of the array once, so many rows in a frame at most. Where it is spread over
/// frames, it begins in one of its own. How often it comes is said for ten rows; an array with fewer rows than the fit
/// level takes has them all in every frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum FitLevel {
    /// Force by the sum of the taxels; the centre stays at the array's middle.
    Sum = 0,
    /// Force by the sum, centre by the moments.
    Moments = 1,
    /// The model, a row a frame: refined every 11th frame.
    #[default]
    OneRow = 2,
    /// The model, two rows a frame: refined every 6th frame.
    TwoRows = 3,
    /// The model, five rows a frame: refined every 3rd frame.
    FiveRows = 4,
    /// The model, all rows and their solution in every frame.
    AllRows = 5,
}

impl FitLevel {
    /// All of them, least first.
    pub const ALL: [Self; 6] = [Self::Sum, Self::Moments, Self::OneRow, Self::TwoRows, Self::FiveRows, Self::AllRows];

    /// The fit level of this number; the largest where there is none.
    pub const fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Sum,
            1 => Self::Moments,
            2 => Self::OneRow,
            3 => Self::TwoRows,
            4 => Self::FiveRows,
            _ => Self::AllRows,
        }
    }

    /// The next lower one, or the least.
    pub const fn lower(self) -> Self {
        Self::from_number((self as u8).saturating_sub(1))
    }

    /// The next higher one, or the largest.
    pub const fn higher(self) -> Self {
        Self::from_number(self as u8 + 1)
    }

    /// Rows of an array of so many that the model takes in a frame at most.
    pub(crate) const fn rows(self, all: usize) -> usize {
        let rows = match self {
            Self::Sum | Self::Moments => 0,
            Self::OneRow => 1,
            Self::TwoRows => 2,
            Self::FiveRows => 5,
            Self::AllRows => all,
        };
        if rows < all { rows } else { all }
    }
}
