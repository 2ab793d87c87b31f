//! The reading of a taxel under a hemispherical tip on a flat plate.
//!
//! Park, Kim and Hirai 2003, eq. 13, 15 and 16, with a plate that may be tilted and a gap that may be rounder than the
//! radius says. Lengths in tip radii, pressures in shares of Young's modulus:
//!
//! ```text
//! p = 1 - G / L        L = sqrt(1 - r^2)        G = 1 - d - t r + k r^2 / 2        0 where G > L
//! ```
//!
//! with r from the tip's axis, d = x - x_c - e F the indentation at the axis (travel x, touch x_c, yield e of the plate), t the plate's tilt and k the roundness. A taxel reads the
//! mean over its square.

use crate::press::Array;

pub const UNKNOWNS: usize = 7;
/// Parts along a side of a taxel.
const SIDE: usize = 5;
/// The shortest column of the tip that is computed, in radii.
const SHORTEST: f64 = 0.2;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Travel at which the tip's apex touches a plate that is not tilted, mm.
    pub touch_mm: f64,
    /// Tip's axis from the array's middle along the columns (x) and the rows (y), mm.
    pub axis_mm: [f64; 2],
    /// Tangent of the plate's tilt along them; where positive, taxels beyond the axis are pressed more.
    pub tilt: [f64; 2],
    /// Excess curvature of the gap between tip and plate over that of the radius, as a share.
    pub roundness: f64,
    /// Compliance of the plate, mm/N.
    pub yields_mm_per_n: f64,
}

impl Pose {
    /// Unknowns of the fit: touch and axis in radii, tilt, roundness, yield in radii for 1 N.
    pub fn unknowns(&self, radius_mm: f64) -> [f64; UNKNOWNS] {
        let Self { touch_mm, axis_mm: [x, y], tilt, roundness, yields_mm_per_n } = *self;
        [touch_mm / radius_mm, x / radius_mm, y / radius_mm, tilt[0], tilt[1], roundness, yields_mm_per_n / radius_mm]
    }

    /// Inverse of [`Pose::unknowns`].
    pub fn of(unknowns: &[f64], radius_mm: f64) -> Self {
        Self {
            touch_mm: unknowns[0] * radius_mm,
            axis_mm: [unknowns[1] * radius_mm, unknowns[2] * radius_mm],
            tilt: [unknowns[3], unknowns[4]],
            roundness: unknowns[5],
            yields_mm_per_n: unknowns[6] * radius_mm,
        }
    }
}

/// Mean pressure on a taxel as a share of Y, with its slopes by the unknowns of the pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    pub value: f64,
    pub slopes: [f64; UNKNOWNS],
}

/// Phase of a press in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct At {
    /// Mean travel, mm.
    pub travel_mm: f64,
    /// Half of the travel within the step, mm.
    pub half_mm: f64,
    pub force_n: f64,
}

/// A part of a taxel: length of the tip's column there, gap at no travel, and how far the compression goes to either side of
/// its mean within the part.
struct Part {
    length: f64,
    gap: f64,
    spread: f64,
    from_axis: [f64; 2],
}

/// Parts of a taxel for one pose: what all travels have in common.
pub struct Square {
    parts: Vec<Part>,
    unknowns: [f64; UNKNOWNS],
    radius_mm: f64,
}

impl Square {
    pub fn new(pose: &Pose, radius_mm: f64, array: &Array, taxel: usize) -> Self {
        let unknowns = pose.unknowns(radius_mm);
        let [touch, axis_x, axis_y, tilt_x, tilt_y, roundness, _] = unknowns;
        let [x, y] = array.place_mm(taxel).map(|place_mm| place_mm / radius_mm);
        let side = array.pitch_mm / radius_mm / SIDE as f64;
        let offset = |index: usize| (index as f64 - 0.5 * (SIDE - 1) as f64) * side;
        let parts = (0..SIDE * SIDE).filter_map(|part| {
            let [x, y] = [x + offset(part % SIDE) - axis_x, y + offset(part / SIDE) - axis_y];
            let distance2 = x * x + y * y;
            let length = (1.0 - distance2).max(0.0).sqrt();
            let gap = 1.0 + touch - tilt_x * x - tilt_y * y + 0.5 * roundness * distance2;
            let round = 1.0 / length + roundness;
            let spread = 0.5 * side * (tilt_x - x * round).hypot(tilt_y - y * round);
            (length > SHORTEST).then_some(Part { length, gap, spread, from_axis: [x, y] })
        });
        Self { parts: parts.collect(), unknowns, radius_mm }
    }

    /// Mean pressure as a share of Y.
    pub fn share(&self, at: &At) -> f64 {
        let (travel, half) = self.travel(at);
        let sum: f64 = self.parts.iter().map(|part| part.mean(travel, half)[0] / part.length).sum();
        sum / (SIDE * SIDE) as f64
    }

    /// Travel less what the plate yields, and half of the travel within the step, in radii.
    fn travel(&self, at: &At) -> (f64, f64) {
        (at.travel_mm / self.radius_mm - self.unknowns[6] * at.force_n, at.half_mm / self.radius_mm)
    }

    pub fn share_with_slopes(&self, at: &At) -> Share {
        let (travel, half) = self.travel(at);
        let [.., tilt_x, tilt_y, roundness, _] = self.unknowns;
        let mut mean = Share::default();
        for part in &self.parts {
            let [compressed, touched] = part.mean(travel, half);
            if touched == 0.0 {
                continue;
            }
            let (inverse, [x, y]) = (1.0 / part.length, part.from_axis);
            mean.value += compressed * inverse;
            // By the length: of the compression L - G over L, where the part touches.
            let by_length = (touched - compressed * inverse) * inverse / part.length;
            let slope = touched * inverse;
            let slopes = [
                -slope,
                (roundness * x - tilt_x) * slope + x * by_length,
                (roundness * y - tilt_y) * slope + y * by_length,
                x * slope,
                y * slope,
                -0.5 * (x * x + y * y) * slope,
                -at.force_n * slope,
            ];
            mean.slopes.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += slope);
        }
        let parts = (SIDE * SIDE) as f64;
        mean.value /= parts;
        mean.slopes.iter_mut().for_each(|slope| *slope /= parts);
        mean
    }
}

impl Part {
    /// Mean compression and the share of the part that touches. Around the rim the compression counts as even within its
    /// spread, so its mean is a parabola: midpoints alone would miss 0.2 % of the peak, which looks like a plate that yields.
    fn mean(&self, travel: f64, half: f64) -> [f64; 2] {
        let middle = self.length - self.gap + travel;
        let spread = self.spread.hypot(half).max(1e-6);
        if middle >= spread {
            [middle, 1.0]
        } else if middle > -spread {
            let over = middle + spread;
            [over * over / (4.0 * spread), over / (2.0 * spread)]
        } else {
            [0.0, 0.0]
        }
    }
}
