//! The normal force between tip and object over a step: elastic, less what is forgotten, in series with the object's
//! own yielding.
//!
//! With the elastic force F_e, a forgotten force S, the object's compliance c and the share k that is left of it all:
//!
//! ```text
//! N(d) = max(0, F_e(d) - S)      x = d + c N(d)      F = k N      E = k (integral of N over d + c N^2 / 2)
//! ```
//!
//! so F = dE/dx. Below the indentation at which F_e = S the tip, not yet back in shape, does not touch.

use super::elastic::Elastic;

/// What holds through a step.
#[derive(Clone, Copy, Debug)]
pub struct Law<'a> {
    /// F_e.
    pub elastic: &'a Elastic,
    /// S.
    pub forgotten_n: f64,
    /// c.
    pub mm_per_n: f64,
    /// k.
    pub left: f64,
}

impl Law<'_> {
    /// The tip's indentation at an overlap; negative where there is none.
    #[inline]
    pub fn depth_mm(&self, x_mm: f64) -> f64 {
        if self.mm_per_n == 0.0 || x_mm <= 0.0 { x_mm } else { self.yielding_mm(x_mm) }
    }

    fn yielding_mm(&self, x_mm: f64) -> f64 {
        // Between these two d + c N(d) - x changes its sign; it rises and bends upwards, so Newton from above never
        // leaves.
        let free_mm = self.elastic.depth_mm(self.forgotten_n);
        if x_mm <= free_mm {
            return x_mm;
        }
        if let Elastic::Plane { n_per_mm2 } = self.elastic {
            let steep = self.mm_per_n * n_per_mm2;
            let ahead = x_mm + self.mm_per_n * self.forgotten_n;
            return 2.0 * ahead / (1.0 + (1.0 + 4.0 * steep * ahead).sqrt());
        }
        let (mut low, mut high) = (free_mm, x_mm);
        let mut d_mm = x_mm;
        for _ in 0..60 {
            let excess = d_mm + self.mm_per_n * self.net_n(d_mm) - x_mm;
            if excess > 0.0 {
                high = d_mm
            } else {
                low = d_mm
            }
            let newton = d_mm - excess / (1.0 + self.mm_per_n * self.elastic.n_per_mm(d_mm));
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - d_mm).abs() <= 1e-16 * x_mm || excess == 0.0 {
                break;
            }
            d_mm = next;
        }
        d_mm
    }

    /// Force at an overlap.
    pub fn force_n(&self, x_mm: f64) -> f64 {
        self.left * self.net_n(self.depth_mm(x_mm))
    }

    /// Force of an indentation.
    pub fn of_depth_n(&self, d_mm: f64) -> f64 {
        self.left * self.net_n(d_mm)
    }

    /// Energy at an overlap, mJ.
    pub fn energy_mj(&self, x_mm: f64) -> f64 {
        let d_mm = self.depth_mm(x_mm);
        let free_mm = self.elastic.depth_mm(self.forgotten_n);
        if d_mm <= free_mm {
            return 0.0;
        }
        let tip = self.elastic.energy_mj(d_mm) - self.elastic.energy_mj(free_mm) - self.forgotten_n * (d_mm - free_mm);
        let net_n = self.net_n(d_mm);
        self.left * (tip + 0.5 * self.mm_per_n * net_n * net_n)
    }

    /// Mean force between two overlaps: the difference in energy over the way.
    #[inline]
    pub fn mean_n(&self, x0: f64, x1: f64) -> f64 {
        if x0 <= 0.0 && x1 <= 0.0 {
            return 0.0;
        }
        if self.mm_per_n == 0.0 {
            return self.left * self.tip_mean_n(x0, x1);
        }
        let (d0, d1) = (self.depth_mm(x0), self.depth_mm(x1));
        let (n0, n1) = (self.net_n(d0), self.net_n(d1));
        let (tip_mm, object_mm) = (d1 - d0, self.mm_per_n * (n1 - n0));
        let way_mm = tip_mm + object_mm;
        if way_mm == 0.0 {
            return self.left * n0;
        }
        self.left * (self.tip_mean_n(d0, d1) * tip_mm + 0.5 * (n0 + n1) * object_mm) / way_mm
    }

    fn net_n(&self, d_mm: f64) -> f64 {
        (self.elastic.force_n(d_mm) - self.forgotten_n).max(0.0)
    }

    #[inline]
    fn tip_mean_n(&self, d0: f64, d1: f64) -> f64 {
        if self.forgotten_n == 0.0 {
            return self.elastic.mean_n(d0, d1);
        }
        let free_mm = self.elastic.depth_mm(self.forgotten_n);
        let (from, to) = (d0.max(free_mm), d1.max(free_mm));
        let share = if d0 == d1 { f64::from(d0 > free_mm) } else { (to - from) / (d1 - d0) };
        (self.elastic.mean_n(from, to) - self.forgotten_n).max(0.0) * share
    }
}
