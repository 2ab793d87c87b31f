//! Taxels under the rim, computed more exactly: two lines across the taxel, each cut at the rim.
//!
//! The mean over the squared distance's spread, which the firmware's model uses, ignores the direction; its error is up
//! to half a percent of the peak for a taxel under the rim. Here the taxel is cut by two Gauss lines along its steeper
//! direction, and the part of each line inside the contact has two Gauss points.

use fingertip::config::Geometry;
use fingertip::contact::parts::{Guess, ONE, PLACE_BITS, PeakScale, SQUARE_BITS, between, interval, root};

/// 1/sqrt(3), Q15: Gauss points on -1 to 1.
const GAUSS: i32 = 18_919;
/// Shift from the square of a place to the format of squared distances, bits.
const TO_SQUARE: u32 = 2 * PLACE_BITS - SQUARE_BITS;

/// A guess worked out for the taxels under its rim.
pub struct Rim<'a> {
    geometry: &'a Geometry,
    height: i32,
    rim_square: i32,
    /// Half of a taxel's side, Q15.
    half: i32,
    /// Gauss points of a side from its middle, Q15.
    line: i32,
    /// Puts the largest strain's top bit at 31.
    lift: u32,
    /// Modulus in shares of the peak over the taxel's side, with `scale_shift`.
    scale: u32,
    scale_shift: u32,
}

impl<'a> Rim<'a> {
    pub fn new(guess: &Guess, scale: &PeakScale, geometry: &'a Geometry) -> Self {
        let half = (geometry.pitch >> (SQUARE_BITS - PLACE_BITS + 1)).max(1);
        let lift = (ONE - guess.height).leading_zeros();
        Self {
            geometry,
            height: guess.height,
            rim_square: guess.rim_square(),
            half,
            line: (half * GAUSS) >> 15,
            lift,
            scale: (scale.modulus.unsigned_abs() << scale.modulus_shift) / half.unsigned_abs(),
            scale_shift: scale.modulus_shift,
        }
    }

    /// Mean pressure on the taxel at a place from the centre, both in Q15, as a share of the peak in Q14.
    pub fn pressure(&self, place: [i32; 2]) -> i32 {
        let [dx, dy] = place.map(i32::abs);
        let (along, across) = if dx < dy { (dy, dx) } else { (dx, dy) };
        let sum = self.chord(along, across - self.line) + self.chord(along, across + self.line);
        // Strain in Q(12 + lift), length in Q15, two lines of two points each; the side is twice `half`.
        ((u64::from(sum) * u64::from(self.scale)) >> (11 + self.lift + self.scale_shift)) as i32
    }

    /// Strain times length, twice its mean, over the part of a line that lies inside.
    #[inline]
    fn chord(&self, along: i32, across: i32) -> u32 {
        let across_square = (across * across) >> TO_SQUARE;
        let left = self.rim_square - across_square;
        if left <= 0 {
            return 0;
        }
        // The root of Q30 is Q15.
        let reach = root(left.unsigned_abs() << TO_SQUARE) as i32;
        let near = (along - self.half).max(-reach);
        let far = (along + self.half).min(reach);
        if far <= near {
            return 0;
        }
        let (middle, part) = ((near + far) >> 1, ((far - near) * GAUSS) >> 16);
        let strains = self.strain(middle - part, across_square) + self.strain(middle + part, across_square);
        ((u64::from(strains) * u64::from((far - near).unsigned_abs())) >> 4) as u32
    }

    /// (L - s) / L, Q(12 + lift).
    #[inline]
    fn strain(&self, along: i32, across_square: i32) -> u32 {
        let square = (((along * along) >> TO_SQUARE) + across_square).unsigned_abs();
        let ([low, up], share) = interval(&self.geometry.nodes, square);
        let length = between(low.length, up.length, share);
        let compressed = (length - self.height).max(0).unsigned_abs();
        (compressed << self.lift) / (length >> 12).max(1).unsigned_abs()
    }
}
