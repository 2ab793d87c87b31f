//! The rows worked out for one indentation.

use fingertip::shipped::{COLUMNS, ROWS};
use sim::mechanics::cells::Cell;
use sim::setup::{Setup, Tip};

/// The rows worked out for one indentation; they are forgotten when it or the setup changes.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    key: [u64; 6],
    rows: [Option<[f64; COLUMNS]>; ROWS],
}

impl Rows {
    /// The mean pressures of a row's taxels.
    pub fn row_kpa(&mut self, setup: &Setup, indentation_mm: f64, row: usize) -> [f64; COLUMNS] {
        let Tip { radius_mm, modulus_kpa } = setup.tip;
        let (x, y, pitch) = (setup.wall.centre_x_mm, setup.wall.centre_y_mm, setup.array.pitch_mm);
        let key = [indentation_mm.max(0.0), radius_mm, modulus_kpa, x, y, pitch].map(f64::to_bits);
        if key != self.key {
            *self = Self { key, ..Self::default() };
        }
        *self.rows[row].get_or_insert_with(|| {
            let tip = setup.tip.flattened(indentation_mm);
            core::array::from_fn(|column| Cell::of(setup, row, column).mean_kpa(&tip))
        })
    }
}
