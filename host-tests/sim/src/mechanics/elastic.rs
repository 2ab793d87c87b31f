//! The tip's elastic force against its indentation: a closed form on a plane, a table on any other surface.

use crate::mechanics::rotor::mean_square;

/// Force and energy of an indentation. Beyond the table the force goes on in a straight line.
#[derive(Clone, Debug, PartialEq)]
pub enum Elastic {
    /// A rigid plane: F = c d^2.
    Plane {
        /// c = pi Y, N/mm^2.
        n_per_mm2: f64,
    },
    /// Straight lines between knots; the energy is their integral, so force = dE/dd holds by construction.
    Table(Table),
}

/// Knots of a force that never falls, from 0 at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Indentation, mm; rising.
    d_mm: Vec<f64>,
    /// Force, N.
    force_n: Vec<f64>,
    /// Energy, mJ.
    energy_mj: Vec<f64>,
}

impl Table {
    /// Of knots from d = 0 on; at least two, d rising, force not falling.
    pub fn new(d_mm: Vec<f64>, force_n: Vec<f64>) -> Self {
        let mut energy_mj = vec![0.0; d_mm.len()];
        for knot in 1..d_mm.len() {
            let mean = 0.5 * (force_n[knot] + force_n[knot - 1]);
            energy_mj[knot] = energy_mj[knot - 1] + mean * (d_mm[knot] - d_mm[knot - 1]);
        }
        Self { d_mm, force_n, energy_mj }
    }

    /// The line that a place lies on, by its lower knot.
    fn below(&self, knots: &[f64], value: f64) -> usize {
        knots.partition_point(|knot| *knot <= value).clamp(1, knots.len() - 1) - 1
    }

    fn slope(&self, line: usize) -> f64 {
        (self.force_n[line + 1] - self.force_n[line]) / (self.d_mm[line + 1] - self.d_mm[line])
    }

    fn on_line(&self, line: usize, d_mm: f64) -> f64 {
        self.force_n[line] + (d_mm - self.d_mm[line]) * self.slope(line)
    }

    fn force_n(&self, d_mm: f64) -> f64 {
        if d_mm <= 0.0 { 0.0 } else { self.on_line(self.below(&self.d_mm, d_mm), d_mm) }
    }

    fn energy_mj(&self, d_mm: f64) -> f64 {
        if d_mm <= 0.0 {
            return 0.0;
        }
        let line = self.below(&self.d_mm, d_mm);
        let over = d_mm - self.d_mm[line];
        self.energy_mj[line] + over * (self.force_n[line] + 0.5 * over * self.slope(line))
    }

    /// The mean force between two indentations. On one line it is the mean of the ends, which loses nothing at any
    /// distance.
    fn mean_n(&self, d0: f64, d1: f64) -> f64 {
        if d0 == d1 {
            return self.force_n(d0);
        }
        let (low, high) = (d0.min(d1), d0.max(d1));
        let (first, last) = (self.below(&self.d_mm, low), self.below(&self.d_mm, high));
        let part = |line: usize, from: f64, to: f64| {
            let (from, to) = (from.max(0.0), to.max(0.0));
            0.5 * (self.on_line(line, from) + self.on_line(line, to)) * (to - from)
        };
        if first == last {
            return part(first, low, high) / (high - low);
        }
        let inner = self.energy_mj[last] - self.energy_mj[first + 1];
        (part(first, low, self.d_mm[first + 1]) + inner + part(last, self.d_mm[last], high)) / (high - low)
    }

    fn depth_mm(&self, force_n: f64) -> f64 {
        if force_n <= 0.0 {
            return 0.0;
        }
        let line = self.below(&self.force_n, force_n);
        self.d_mm[line] + (force_n - self.force_n[line]) / self.slope(line)
    }
}

impl Elastic {
    /// Force of an indentation; 0 without one.
    pub fn force_n(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => n_per_mm2 * d_mm.max(0.0) * d_mm.max(0.0),
            Self::Table(table) => table.force_n(d_mm),
        }
    }

    /// The inverse of [`Elastic::force_n`]; 0 without a force.
    pub fn depth_mm(&self, force_n: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => (force_n.max(0.0) / n_per_mm2).sqrt(),
            Self::Table(table) => table.depth_mm(force_n),
        }
    }

    /// Energy of an indentation, mJ.
    pub fn energy_mj(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => n_per_mm2 / 3.0 * d_mm.max(0.0).powi(3),
            Self::Table(table) => table.energy_mj(d_mm),
        }
    }

    /// Mean force between two indentations: the difference in energy over the way.
    #[inline]
    pub fn mean_n(&self, d0: f64, d1: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => mean_square(*n_per_mm2, d0, d1),
            Self::Table(table) => table.mean_n(d0, d1),
        }
    }

    /// How steep it is.
    pub fn n_per_mm(&self, d_mm: f64) -> f64 {
        match self {
            Self::Plane { n_per_mm2 } => 2.0 * n_per_mm2 * d_mm.max(0.0),
            Self::Table(table) => table.slope(table.below(&table.d_mm, d_mm)),
        }
    }
}
