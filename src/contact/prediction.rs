//! A guess of the contact, and the model's prediction of each taxel from it.

use crate::arith::{between, clamp_to, high, reciprocal, root};
use crate::config::Shaped;
use crate::config::array::{Geometry, NODE_BITS, NODES, Node, ONE, PLACE_BITS, SQUARE_BITS};
use crate::model::Tip;
use crate::pressure::{CODE_BITS, TactileImage};
use crate::units::Millimetres;

/// Fractional bits of a centre.
pub const CENTRE_BITS: u32 = 24;
/// Fractional bits of a slope.
pub const SLOPE_BITS: u32 = 13;
/// Least s, for the deepest indentation of the fit: 7/8 of the radius.
pub const HEIGHT_MIN: i32 = ONE / 8;
/// Largest s, for the shallowest indentation of the fit: 1/1024 of the radius.
pub const HEIGHT_MAX: i32 = ONE - ONE / 1024;
/// Largest squared distance of a taxel that a contact can reach.
const SQUARE_MAX: u32 = 3 << (SQUARE_BITS - 1);

/// Guess of a contact, in tip radii.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Guess {
    /// s = 1 - d, Q28.
    pub height: i32,
    /// Centre, Q24.
    pub x: i32,
    /// Centre, Q24.
    pub y: i32,
}

impl Guess {
    /// Returns the nearest guess that the fit covers: the centre within a radius of the array.
    pub fn new(height: i32, x: i32, y: i32, geometry: &Geometry) -> Self {
        let [reach_x, reach_y] = geometry.reach;
        let centre = |value: i32, reach: i32| clamp_to(value.into(), reach);
        Self { height: height.min(HEIGHT_MAX).max(HEIGHT_MIN), x: centre(x, reach_x), y: centre(y, reach_y) }
    }

    /// Converts lengths to a guess.
    pub fn from_lengths(d: Millimetres, x: Millimetres, y: Millimetres, geometry: &Geometry) -> Self {
        let share = |length: Millimetres, bits: u32| {
            let wide = i64::from(length.to_bits()) * i64::from(geometry.inverse_radius);
            clamp_to(wide >> (56 - bits), i32::MAX)
        };
        Self::new(ONE - share(d, SQUARE_BITS), share(x, CENTRE_BITS), share(y, CENTRE_BITS), geometry)
    }

    /// Indentation.
    pub fn indentation(&self, tip: &Tip) -> Millimetres {
        Millimetres::from_bits(scale(ONE - self.height, tip, SQUARE_BITS))
    }

    /// Centre along the columns and along the rows.
    pub fn centre(&self, tip: &Tip) -> [Millimetres; 2] {
        [self.x, self.y].map(|value| Millimetres::from_bits(scale(value, tip, CENTRE_BITS)))
    }

    /// s^2, Q28.
    pub fn height_square(&self) -> i32 {
        high(self.height, self.height) << 4
    }

    /// r_c^2 = 1 - s^2, Q28.
    pub fn rim_square(&self) -> i32 {
        ONE - self.height_square()
    }
}

/// Converts a number of radii to a length.
fn scale(radii: i32, tip: &Tip, bits: u32) -> i32 {
    ((i64::from(radii) * i64::from(tip.radius().to_bits())) >> bits) as i32
}

/// Prediction of a taxel: pressure as a share of the peak, and its slopes.
#[derive(Clone, Copy, Debug, Default)]
pub struct TaxelModel {
    /// Pressure, Q14 of the peak.
    pub pressure: i32,
    /// Slope of the pressure over ln(s), in Y, Q13: `-dp / d ln(s)`.
    pub by_height: i32,
    /// Slope of the pressure over the squared distance, negative, times 2 s^2, in Y, Q13.
    pub by_square: i32,
}

/// Prediction of all taxels from a guess.
#[derive(Clone, Debug)]
pub struct Prediction<const ROWS: usize, const COLUMNS: usize> {
    /// s, Q28.
    pub height: i32,
    /// s^3, Q27.
    height_cube_q27: i32,
    /// Squared distance below which a taxel lies inside the contact.
    pub inside: u32,
    /// Squared distance from which on a taxel lies outside the contact.
    pub outside: u32,
    /// Twice the modulus in shares of the peak, Q14.
    twice_modulus: i32,
    modulus: i32,
    modulus_shift: u32,
    /// Places of the columns relative to the contact's centre, Q15.
    pub dx: [i32; COLUMNS],
    /// Squares of these places, Q28.
    pub dx_square: [u32; COLUMNS],
    /// Places of the rows relative to the contact's centre, Q15.
    pub dy: [i32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Prediction<ROWS, COLUMNS> {
    /// Prediction of no contact.
    pub const NONE: Self = Self {
        height: 0,
        height_cube_q27: 0,
        inside: 0,
        outside: 0,
        twice_modulus: 0,
        modulus: 0,
        modulus_shift: 0,
        dx: [0; COLUMNS],
        dx_square: [0; COLUMNS],
        dy: [0; ROWS],
    };

    /// Predicts the taxels from a guess, in shares of this scale's peak.
    pub fn new(guess: &Guess, scale: &PeakScale, config: &Shaped<ROWS, COLUMNS>) -> Self {
        let geometry = &config.geometry;
        // The rim's radius, widened by what a taxel's size adds to its mean squared distance, Q15.
        let widened = guess.rim_square() + high(geometry.pitch, geometry.pitch) / 12 * 16;
        let middle = root((widened as u32) << 2) as i32;
        let half = geometry.pitch >> (SQUARE_BITS - PLACE_BITS + 1);
        let square_of = |place: i32| square(place.max(0)).min(SQUARE_MAX);
        let dx = from(&config.columns, guess.x);
        Self {
            height: guess.height,
            height_cube_q27: high(guess.height_square(), guess.height) << 3,
            inside: square_of(middle - half),
            outside: square_of(middle + half),
            twice_modulus: 2 * scale.modulus,
            modulus: scale.modulus << scale.modulus_shift,
            modulus_shift: scale.modulus_shift,
            dx,
            dx_square: dx.map(square),
            dy: from(&config.rows, guess.y),
        }
    }

    /// Predicts a taxel at a squared distance below [`Prediction::outside`].
    #[inline(always)]
    pub fn taxel(&self, square: u32, nodes: &[Node; NODES]) -> TaxelModel {
        let ([low, up], share) = interval(nodes, square);
        if square < self.inside {
            let rise = up.mean_inverse_length - low.mean_inverse_length;
            let mean = low.mean_inverse_length + 2 * high(rise, share);
            let left_q22 = high(self.height, mean);
            let strain_q22 = ((1 << 22) - left_q22).max(0);
            return TaxelModel {
                pressure: high(strain_q22 << 9, self.twice_modulus),
                by_height: left_q22 >> (22 - SLOPE_BITS),
                by_square: high(rise, self.height_cube_q27),
            };
        }
        let length = between(low.near_length, up.near_length, share);
        let compressed = (length - self.height).max(0);
        // (L1 - s) / (h r), Q14, below 8.
        let ratio = high(compressed, between(low.inverse_spread, up.inverse_spread, share)).min((8 << 14) - 1);
        // Under the rim the column is hardly longer than s, so both slopes are taken as equal.
        let slope = high(ratio << 3, self.height).min(3 << (SLOPE_BITS - 1));
        TaxelModel {
            pressure: high(high(compressed, self.modulus), ratio << 14) >> (self.modulus_shift - 7),
            by_height: slope,
            by_square: slope,
        }
    }
}

/// Returns places relative to a centre, Q15.
#[inline(always)]
fn from<const SIDE: usize>(places: &[i32; SIDE], centre: i32) -> [i32; SIDE] {
    places.map(|place| place - (centre >> (CENTRE_BITS - PLACE_BITS)))
}

/// Returns the nodes around a squared distance, and its relative position between them in Q31.
#[inline(always)]
pub fn interval(nodes: &[Node; NODES], square: u32) -> ([&Node; 2], i32) {
    let index = ((square >> NODE_BITS) as usize).min(NODES - 2);
    ([&nodes[index], &nodes[index + 1]], ((square << (32 - NODE_BITS)) >> 1) as i32)
}

/// Returns the square of a place, Q28, at most 4.
#[inline(always)]
pub fn square(place: i32) -> u32 {
    let place = place.unsigned_abs().min(u32::from(u16::MAX));
    (place * place) >> 2
}

/// Fractional bits of a pressure as a share of the peak.
pub const PEAK_BITS: u32 = 14;
/// Lowest peak that is fitted: one code.
const PEAK_MIN: i32 = 1 << CODE_BITS;
/// Highest peak that converter, sag and gain allow.
const PEAK_MAX: i32 = 1 << 18;
/// Largest modulus as a share of the peak: 512. Below that indentation of a / 512 the model gives no more than the
/// sum.
const MODULUS_MAX: u32 = 1 << (PEAK_BITS + 9);
/// Least modulus as a share of the peak. With less, the tip would be pressed flat.
const MODULUS_MIN: u32 = 1 << (PEAK_BITS - 1);

/// Tactile image and its scale.
pub struct ScaledImage<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Tactile image.
    pub picture: &'a TactileImage<ROWS, COLUMNS>,
    /// Scale by the image's peak.
    pub scale: PeakScale,
}

/// Scale of an image to shares of its highest taxel: 2^14 is the peak, so products fit 32 bits whatever the load.
#[derive(Clone, Copy, Debug)]
pub struct PeakScale {
    /// 2^34 over the peak.
    inverse_peak: i32,
    /// Y in shares of the peak, Q14.
    pub modulus: i32,
    /// Left shift that puts the modulus' top bit at 30.
    pub modulus_shift: u32,
    /// 2^(62 - modulus_shift) over the modulus.
    pub inverse_modulus: u32,
}

impl<const ROWS: usize, const COLUMNS: usize> ScaledImage<'_, ROWS, COLUMNS> {
    /// Returns a taxel as a share of the peak, Q14. Taxels below -2^18 have no meaning.
    #[inline(always)]
    pub fn share(&self, taxel: i32) -> i32 {
        self.scale.share(taxel)
    }
}

impl PeakScale {
    /// Scale of no contact.
    pub const NONE: Self = Self { inverse_peak: 0, modulus: 0, modulus_shift: 0, inverse_modulus: 0 };

    /// Scale by a peak; none if the peak is too low for the model.
    pub fn new(peak: i32, geometry: &Geometry) -> Option<Self> {
        if peak < PEAK_MIN {
            return None;
        }
        let divisor = peak.min(PEAK_MAX).unsigned_abs();
        let (whole, rest) = (geometry.modulus_q8 / divisor, geometry.modulus_q8 % divisor);
        if whole >= MODULUS_MAX >> (PEAK_BITS - 8) {
            return None;
        }
        let modulus = ((whole << (PEAK_BITS - 8)) + (rest << (PEAK_BITS - 8)) / divisor).max(MODULUS_MIN);
        let modulus_shift = modulus.leading_zeros() - 1;
        Some(Self {
            inverse_peak: (reciprocal(divisor << divisor.leading_zeros()) >> (29 - divisor.leading_zeros())) as i32,
            modulus: modulus as i32,
            modulus_shift,
            inverse_modulus: reciprocal(modulus << (modulus_shift + 1)),
        })
    }

    #[inline(always)]
    fn share(&self, taxel: i32) -> i32 {
        high(taxel << (PEAK_BITS - 2), self.inverse_peak)
    }

    /// Square of the converter's resolution as a share: a third of a code's square.
    pub fn converter_square(&self) -> u32 {
        let code = self.share(1 << CODE_BITS).unsigned_abs();
        code * code / 3
    }
}
