//! Tip on a surface that is not a plane: force, centre and mean pressures from the height of the surface.
//!
//! The local compression is `dL = sqrt(a^2 - r^2) - (a - d) + h(x, y)` and the pressure `Y dL / L`, `L = sqrt(a^2 -
//! r^2)`, so with polar coordinates, as `r dr = -L dL`, the force is `Y` times the integral of `dL` over `L` and the
//! angle: sample by sample, a ramp that begins at the clearance `a - L - h` of the sample.

use crate::effects::contact::Named;
use crate::mechanics::normal::{Elastic, Table};
use crate::mechanics::pressures::Cell;
use crate::setup::Tip;
use core::f64::consts::TAU;

/// Samples around the axis, and from the apex to the rim of the tip.
const AROUND: usize = 64;
const OUTWARDS: usize = 256;
/// Knots of the force, evenly spaced in the square root of the indentation.
const KNOTS: usize = 2048;
/// Samples along the side of a taxel.
const ALONG: usize = 16;

/// Force and centre of pressure against indentation.
pub fn tables(effects: &Named, tip: &Tip) -> (Elastic, Vec<[f64; 3]>) {
    let mut samples = samples(effects, tip);
    samples.sort_by(|a, b| a.clearance_mm.total_cmp(&b.clearance_mm));
    let deepest_mm = Tip::DEEPEST * tip.radius_mm;
    let (mut d_mm, mut force_n, mut centres) = (Vec::new(), Vec::new(), Vec::new());
    // Sums over the touching samples of weight and weight times clearance, alone and times the place.
    let mut sums = [[0.0; 2]; 3];
    let mut reached = samples.iter().peekable();
    for knot in 0..=KNOTS {
        let share = knot as f64 / KNOTS as f64;
        let depth_mm = share * share * deepest_mm;
        while let Some(sample) = reached.next_if(|sample| sample.clearance_mm < depth_mm) {
            for (sum, by) in sums.iter_mut().zip([1.0, sample.x_mm, sample.y_mm]) {
                sum[0] += sample.weight * by;
                sum[1] += sample.weight * by * sample.clearance_mm;
            }
        }
        let [force, x, y] = sums.map(|[weight, clearance]| (weight * depth_mm - clearance) * tip.modulus_kpa * 1e-3);
        let before = force_n.last().copied().unwrap_or(0.0);
        let force = if knot == 0 { 0.0 } else { f64::max(force, before) };
        d_mm.push(depth_mm);
        force_n.push(force);
        centres.push([depth_mm, if force > 0.0 { x / force } else { 0.0 }, if force > 0.0 { y / force } else { 0.0 }]);
    }
    (Elastic::Table(Table::new(d_mm, force_n)), centres)
}

/// Place on the tip: the indentation at which it touches, and its weight in the integral.
struct Sample {
    clearance_mm: f64,
    weight: f64,
    x_mm: f64,
    y_mm: f64,
}

fn samples(effects: &Named, tip: &Tip) -> Vec<Sample> {
    let radius_mm = tip.radius_mm;
    let mut samples = Vec::with_capacity(AROUND * OUTWARDS);
    for outwards in 0..OUTWARDS {
        // L = a (1 - t^2): closest at the apex, where shallow contacts are.
        let t = (outwards as f64 + 0.5) / OUTWARDS as f64;
        let length_mm = radius_mm * (1.0 - t * t);
        let weight = 2.0 * radius_mm * t / OUTWARDS as f64 * TAU / AROUND as f64;
        let r_mm = (radius_mm * radius_mm - length_mm * length_mm).sqrt();
        for around in 0..AROUND {
            let angle = TAU * (around as f64 + 0.5) / AROUND as f64;
            let (x_mm, y_mm) = (r_mm * libm::cos(angle), r_mm * libm::sin(angle));
            let clearance_mm = radius_mm - length_mm - effects.height_mm(x_mm, y_mm, radius_mm);
            samples.push(Sample { clearance_mm, weight, x_mm, y_mm });
        }
    }
    samples
}

/// Places on the taxels, by the midpoints of their squares: the indentation at which the tip touches there, mm, and 1/L.
pub struct Points {
    clearance_mm: Vec<f64>,
    per_length: Vec<f64>,
}

impl Points {
    /// Points of the taxels of these squares.
    pub fn of(effects: &Named, tip: &Tip, cells: impl Iterator<Item = Cell>) -> Self {
        let at = |side: [f64; 2], n: usize| side[0] + (side[1] - side[0]) * (n as f64 + 0.5) / ALONG as f64;
        let (mut clearance_mm, mut per_length) = (Vec::new(), Vec::new());
        for cell in cells {
            for (i, j) in (0..ALONG).flat_map(|i| (0..ALONG).map(move |j| (i, j))) {
                let (x_mm, y_mm) = (at(cell.x_mm, i), at(cell.y_mm, j));
                let length_mm = (tip.radius_mm * tip.radius_mm - x_mm * x_mm - y_mm * y_mm).max(0.0).sqrt();
                let reached_mm = length_mm + effects.height_mm(x_mm, y_mm, tip.radius_mm);
                clearance_mm.push(tip.radius_mm - reached_mm);
                // At the rim of the tip nothing is left to compress.
                per_length.push(if length_mm > 0.0 { 1.0 / length_mm } else { 0.0 });
            }
        }
        Self { clearance_mm, per_length }
    }

    /// Mean pressure on each taxel at an indentation, as shares of Y, in the order of the squares.
    pub fn means(&self, d_mm: f64) -> impl Iterator<Item = f64> {
        /// Sums side by side, which the processor adds at once.
        const LANES: usize = 8;
        let taxels = self.clearance_mm.chunks_exact(ALONG * ALONG).zip(self.per_length.chunks_exact(ALONG * ALONG));
        taxels.map(move |(clearance_mm, per_length)| {
            let mut sums = [0.0; LANES];
            for (clearances, lengths) in clearance_mm.chunks_exact(LANES).zip(per_length.chunks_exact(LANES)) {
                for lane in 0..LANES {
                    let compressed = (d_mm - clearances[lane]).max(0.0) * lengths[lane];
                    sums[lane] += compressed.min(Tip::DEEPEST);
                }
            }
            sums.iter().sum::<f64>() / (ALONG * ALONG) as f64
        })
    }
}
