//! Taxels under the rim, worked out closely: two lines across the taxel, each cut where it meets the rim.
//!
//! The mean over the squared distance's spread, which the quick model uses, knows no direction and is off by up to half a
//! percent of the peak for a taxel under the rim. Here the taxel is cut by two Gauss lines along its steeper direction,
//! and what of each lies inside the contact has two Gauss points.

use super::geometry::{Geometry, ONE, PLACE_BITS, SQUARE_BITS};
use super::guess::Guess;
use super::view::View;
use crate::root::floor_sqrt;

/// 1/sqrt(3), Q15: Gauss points on -1 to 1.
const GAUSS: i32 = 18_919;
/// Bits from the square of a place to a squared distance.
const TO_SQUARE: u32 = 2 * PLACE_BITS - SQUARE_BITS;

/// A guess worked out for the taxels under its rim.
pub(super) struct Rim {
    rest: i32,
    rim_square: i32,
    /// Half of a taxel's side, Q15.
    half: i32,
    /// Gauss points of a side from its middle, Q15.
    line: i32,
    /// Puts the largest strain's top bit at 31.
    lift: u32,
}

impl Rim {
    pub fn new(guess: &Guess, geometry: &Geometry) -> Self {
        let half = (geometry.pitch >> (SQUARE_BITS - PLACE_BITS + 1)).max(1);
        Self {
            rest: guess.rest,
            rim_square: guess.rim_square(),
            half,
            line: (half * GAUSS) >> 15,
            lift: (ONE - guess.rest).leading_zeros(),
        }
    }

    /// Mean pressure on the taxel at a place from the centre, both in Q15, as a share of the peak in Q14.
    pub fn pressure(&self, dx: i32, dy: i32, view: &View) -> i32 {
        let (dx, dy) = (dx.abs(), dy.abs());
        let (along, across) = if dx < dy { (dy, dx) } else { (dx, dy) };
        let sum = self.chord(along, across - self.line) + self.chord(along, across + self.line);
        // Two lines of two points each; the side's length is taken out here.
        let mean = (sum >> 4) as u32 / (2 * self.half).unsigned_abs();
        ((u64::from(mean) * u64::from(view.modulus.unsigned_abs())) >> (10 + self.lift)) as i32
    }

    /// Strain times length, twice its mean, over the part of a line that lies inside: Q(12 + lift) and Q15.
    fn chord(&self, along: i32, across: i32) -> u64 {
        let across_square = (across * across) >> TO_SQUARE;
        let left = self.rim_square - across_square;
        if left <= 0 {
            return 0;
        }
        let reach = floor_sqrt(u64::from(left.unsigned_abs()) << TO_SQUARE) as i32;
        let near = (along - self.half).max(-reach);
        let far = (along + self.half).min(reach);
        if far <= near {
            return 0;
        }
        let (middle, part) = ((near + far) >> 1, ((far - near) * GAUSS) >> 16);
        let strains = self.strain(middle - part, across_square) + self.strain(middle + part, across_square);
        strains * u64::from((far - near).unsigned_abs())
    }

    /// (L - s) / L, Q(12 + lift).
    fn strain(&self, along: i32, across_square: i32) -> u64 {
        let square = ((along * along) >> TO_SQUARE) + across_square;
        let length = floor_sqrt(u64::from((ONE - square).max(0).unsigned_abs()) << SQUARE_BITS) as i32;
        let wet = (length - self.rest).max(0).unsigned_abs();
        u64::from((wet << self.lift) / (length >> 12).max(1).unsigned_abs())
    }
}
