//! Network of an array whose rows float while they are not driven.

use super::Row;
use fingertip::shipped::{COLUMNS, ROWS};

/// Conductances seen from the columns, where all rows but the driven one float.
///
/// With the floating rows eliminated the columns form a network A = D - sum g g' / line, symmetric and positive definite.
/// Column j alone at the virtual ground sees (A^-1 g)_j / (A^-1)_jj, g the driven row. By A = L L' (Cholesky) and M =
/// L^-1, A^-1 = M' M.
pub struct Floating {
    /// Conductance from a line to the virtual ground, S.
    hold: f64,
    /// A with the rows above the next one, which do not change within a scan: each is added once.
    above: [Row; COLUMNS],
    next: usize,
}

impl Floating {
    /// Network of lines with a conductance to the virtual ground.
    pub fn new(hold: f64) -> Self {
        Self { hold, above: [Row::default(); COLUMNS], next: 0 }
    }

    /// Conductances that the columns see of the driven row.
    pub fn seen(&mut self, driven: usize, array: &[Row; ROWS]) -> Row {
        if driven != self.next {
            self.above = [Row::default(); COLUMNS];
            array[..driven].iter().for_each(|siemens| float(&mut self.above, siemens, self.hold));
        }
        let mut a = self.above;
        float(&mut self.above, &array[driven], self.hold);
        self.next = driven + 1;
        array[driven].iter().enumerate().for_each(|(c, g)| a[c][c] += g);
        array[driven + 1..].iter().for_each(|siemens| float(&mut a, siemens, self.hold));
        // L replaces the lower half of A and M that of the identity, line by line.
        let mut m = [[0.0; COLUMNS]; COLUMNS];
        for i in 0..COLUMNS {
            a[i][i] += self.hold;
            let mut line = [0.0; COLUMNS];
            line[i] = 1.0;
            for j in 0..i {
                let (above, below) = a.split_at_mut(i);
                let known: f64 = above[j][..j].iter().zip(&below[0][..j]).map(|(a, b)| a * b).sum();
                let share = (below[0][j] - known) / above[j][j];
                below[0][j] = share;
                line.iter_mut().zip(&m[j]).for_each(|(entry, part)| *entry -= share * part);
            }
            let length = (a[i][i] - a[i][..i].iter().map(|l| l * l).sum::<f64>()).sqrt();
            a[i][i] = length;
            m[i] = line.map(|entry| entry / length);
        }
        let (mut open, mut diagonal) = ([0.0; COLUMNS], [0.0; COLUMNS]);
        for line in &m {
            let along: f64 = line.iter().zip(&array[driven]).map(|(m, g)| m * g).sum();
            for (j, m) in line.iter().enumerate() {
                open[j] += m * along;
                diagonal[j] += m * m;
            }
        }
        core::array::from_fn(|j| (open[j] / diagonal[j]).max(0.0))
    }
}

/// Adds a floating row to the lower half of A.
fn float(a: &mut [Row; COLUMNS], siemens: &Row, hold: f64) {
    let per_line = 1.0 / (hold + siemens.iter().sum::<f64>());
    for (c, g) in siemens.iter().enumerate() {
        let share = g * per_line;
        a[c].iter_mut().zip(&siemens[..=c]).for_each(|(a, other)| *a -= share * other);
        a[c][c] += g;
    }
}
