//! Network of an array whose rows float while they are not driven.

use super::Row;
use fingertip::shipped::{COLUMNS, ROWS};

type Matrix = [Row; COLUMNS];

/// Conductances seen from the columns, where all rows but the driven one float.
///
/// With the floating rows eliminated the columns form a network A = D - sum g g' / line, symmetric and positive definite.
/// Column j alone at the virtual ground sees (A^-1 g)_j / (A^-1)_jj, g the driven row. By A = L D L' and M = L^-1,
/// A^-1 = M' D^-1 M.
pub struct Floating {
    /// Conductance from a line to the virtual ground, S.
    hold: f64,
    /// Part of A of the rows above the next one: each is added once a scan.
    above: Matrix,
    /// Part of A of each row and all below it, as the scan finds them.
    below: [Matrix; ROWS + 1],
    next: usize,
}

impl Floating {
    pub fn new(hold: f64) -> Self {
        Self { hold, above: Matrix::default(), below: [Matrix::default(); ROWS + 1], next: ROWS }
    }

    /// Conductances that the columns see of the driven row.
    pub fn seen(&mut self, driven: usize, array: &[Row; ROWS]) -> Row {
        if driven != self.next {
            self.above = Matrix::default();
            array[..driven].iter().for_each(|siemens| float(&mut self.above, siemens, self.hold));
            for row in (driven + 1..ROWS).rev() {
                self.below[row] = self.below[row + 1];
                float(&mut self.below[row], &array[row], self.hold);
            }
        }
        let mut a = Matrix::default();
        let (mut flow, mut diagonal) = (array[driven], Row::default());
        for (c, line) in a.iter_mut().enumerate() {
            let parts = self.above[c].iter().zip(&self.below[driven + 1][c]);
            line.iter_mut().zip(parts).for_each(|(a, (above, below))| *a = above + below);
            line[c] += flow[c] + self.hold;
            diagonal[c] = line[c];
        }
        float(&mut self.above, &array[driven], self.hold);
        self.next = driven + 1;

        for k in 0..COLUMNS {
            // A line of M left of the pivot; right of it the line of A that remains.
            let (line, per_pivot) = (a[k], 1.0 / diagonal[k]);
            let along = flow[k] * per_pivot;
            let mut shares = line;
            for j in 0..COLUMNS {
                flow[j] -= line[j] * along;
                shares[j] *= per_pivot;
                diagonal[j] -= shares[j] * line[j];
            }
            (flow[k], diagonal[k]) = (-along, -per_pivot);
            // One more than the pivot, so that the column below it becomes one of M.
            let mut changes = line;
            changes[k] += 1.0;
            for i in k + 1..COLUMNS {
                a[i].iter_mut().zip(&changes).for_each(|(entry, change)| *entry -= shares[i] * change);
            }
        }
        core::array::from_fn(|j| (flow[j] / diagonal[j]).max(0.0))
    }
}

/// Adds the conductances of one floating row to a sum that A is made of.
fn float(a: &mut Matrix, siemens: &Row, hold: f64) {
    let per_line = 1.0 / (hold + siemens.iter().sum::<f64>());
    for (c, g) in siemens.iter().enumerate() {
        let share = g * per_line;
        a[c].iter_mut().zip(siemens).for_each(|(a, other)| *a -= share * other);
        a[c][c] += g;
    }
}
