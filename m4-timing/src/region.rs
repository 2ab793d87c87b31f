//! What was measured: the passes of each region, and their statistics.

use crate::core::Cycles;

/// The figures of one pass through a region, or of many together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Instructions executed, those whose condition did not hold too.
    pub instructions: u64,
    /// Cycles without wait states.
    pub cycles: Cycles,
    /// The estimate with the flash's wait states.
    pub flash: u64,
}

impl Figures {
    /// The names of the figures, in their order.
    pub const NAMES: [&str; 5] = ["instructions", "low", "estimate", "high", "flash"];

    /// In the order of [`Figures::NAMES`].
    pub const fn values(&self) -> [u64; 5] {
        let Self { instructions, cycles: Cycles { low, estimate, high }, flash } = *self;
        [instructions, low, estimate, high, flash]
    }
}

/// A figure over the passes of a region.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Sum.
    pub total: u64,
    /// Smallest.
    pub min: u64,
    /// The one in the middle; of an even number the lower of the two.
    pub median: u64,
    /// Largest.
    pub max: u64,
}

impl Summary {
    fn of(mut values: Vec<u64>) -> Self {
        values.sort_unstable();
        let at = |place: Option<usize>| place.and_then(|place| values.get(place)).copied().unwrap_or(0);
        Self {
            total: values.iter().sum(),
            min: at(Some(0)),
            median: at(values.len().checked_sub(1).map(|last| last / 2)),
            max: at(values.len().checked_sub(1)),
        }
    }
}

/// The passes of a region.
#[derive(Clone, Debug, Default)]
pub struct Region {
    passes: Vec<[u64; 5]>,
}

impl Region {
    /// Adds a pass.
    pub fn push(&mut self, pass: &Figures) {
        self.passes.push(pass.values());
    }

    /// How many passes there were.
    pub fn passes(&self) -> usize {
        self.passes.len()
    }

    /// Each figure over the passes, in the order of [`Figures::NAMES`].
    pub fn summaries(&self) -> [Summary; 5] {
        std::array::from_fn(|figure| Summary::of(self.passes.iter().map(|pass| pass[figure]).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_lies_in_the_middle_of_the_passes() {
        let of = |values: &[u64]| Summary::of(values.to_vec());
        assert_eq!(of(&[5, 1, 9]), Summary { total: 15, min: 1, median: 5, max: 9 });
        assert_eq!(of(&[4, 1, 9, 2]), Summary { total: 16, min: 1, median: 2, max: 9 });
        assert_eq!(of(&[]), Summary::default());
    }
}
