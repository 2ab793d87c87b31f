//! Constants of the array: its characteristic, its drift, the converter's range, and the geometry under the tip.
//!
//! # Geometry
//!
//! The fit has a table of the model over the squared distance. Lengths are in tip radii. A taxel at the distance r from
//! the contact's centre, with sides h, sees squared distances spread around `r^2 + h^2/6` with the variance `(h r)^2 /
//! 3` whatever its direction. So its mean is taken over squared distances spread evenly over `r^2 + h^2/6 +- h r`, and
//! both parts of the model have closed forms there:
//!
//! - inside the contact, `p/Y = 1 - s G` with `G = (L1 - L2) / (h r)`, the mean of 1/L,
//! - under the rim, `p/Y = (L1 - s)^2 / (2 h r)`,
//!
//! where s is the distance between the plane and the hemisphere's centre, `1 - d`, and
//! `L1 = sqrt(1 - r^2 - h^2/6 + h r)` and `L2 = sqrt(1 - r^2 - h^2/6 - h r)` are the columns' lengths at the near and
//! the far end of the spread.

use super::{ConfigError, exp2, narrow};
use crate::arith::floor_sqrt;
use crate::frame::CODE_MAX;
use crate::model::Tip;
use crate::params::{ParamError, Params};
use crate::units::{Kilopascals, Newtons};

/// Fractional bits of a squared distance, of a column's length and of s.
pub const SQUARE_BITS: u32 = 28;
/// Fractional bits of a taxel's place.
pub const PLACE_BITS: u32 = 15;
/// Fractional bits below a node: the squared distance from node to node is 1/128.
pub const NODE_BITS: u32 = SQUARE_BITS - 7;
/// Number of nodes of the table; the last one is at 1.5, where no contact within the radius reaches a taxel.
pub const NODES: usize = 193;
/// 1 in Q28.
pub const ONE: i32 = 1 << SQUARE_BITS;

/// Model at one distance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    /// G, Q26.
    pub mean_inverse_length: i32,
    /// L, Q28.
    pub length: i32,
    /// L1, Q28.
    pub near_length: i32,
    /// 1 / (h r), Q18.
    pub inverse_spread: i32,
}

/// The array under the tip, in tip radii.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// h, Q28.
    #[doc(hidden)]
    pub pitch: i32,
    /// Largest distance of a contact's centre from the array's middle: a radius beyond its edge along the columns and
    /// the rows, Q24.
    pub(crate) reach: [i32; 2],
    /// 2^56 over the tip's radius in units of its last place.
    pub(crate) inverse_radius: i32,
    /// Reading of a taxel under the pressure Y, in sixteenths of a code, Q8.
    pub(crate) modulus_q8: u32,
    /// Model over the squared distance.
    #[doc(hidden)]
    pub nodes: [Node; NODES],
}

impl Geometry {
    /// Computes the geometry in integers, from parameters that have been checked.
    pub(crate) fn new(params: &Params, codes_milli: i32, rows: usize, columns: usize) -> Self {
        let (pitch_um, radius_um) = (i64::from(params.pitch_um), i64::from(params.tip_radius_um.max(1)));
        let pitch = ((pitch_um << SQUARE_BITS) / radius_um) as i32;
        let units_q8 = i64::from(params.modulus_pa) * i64::from(codes_milli) * (16 << 8) / 1_000_000;
        let mut nodes = [Node::default(); NODES];
        for (index, node) in nodes.iter_mut().enumerate().skip(1) {
            *node = Node::at((index as i64) << NODE_BITS, i64::from(pitch));
        }
        // At the centre the distance spreads nothing; a taxel there is under the rim only if the whole contact is
        // smaller than a taxel.
        let [centre, first, ..] = &mut nodes;
        let near_length = root(i64::from(ONE) - square(i64::from(pitch)) / 6);
        *centre = Node {
            mean_inverse_length: ((1 << 54) / i64::from(near_length).max(1)) as i32,
            length: ONE,
            near_length,
            inverse_spread: 2 * first.inverse_spread,
        };
        Self {
            pitch,
            reach: [columns, rows].map(|side| ((side as i32 * (pitch >> 4)) >> 1) + (1 << (SQUARE_BITS - 4))),
            inverse_radius: ((1_i64 << 32) * 1000 / radius_um) as i32,
            modulus_q8: units_q8.max(1).min(i64::from(u32::MAX)) as u32,
            nodes,
        }
    }
}

/// Middles of columns or rows, from the array's middle in tip radii, Q15.
pub(crate) fn places<const SIDE: usize>(params: &Params) -> [i32; SIDE] {
    let (pitch_um, radius_um) = (i64::from(params.pitch_um), i64::from(params.tip_radius_um.max(1)));
    let mut places = [0; SIDE];
    for (place, half_pitches) in places.iter_mut().zip((1 - SIDE as i64..).step_by(2)) {
        *place = (((half_pitches * pitch_um) << (PLACE_BITS - 1)) / radius_um) as i32;
    }
    places
}

impl Node {
    /// Computes the model at a squared distance above 0, for taxels with sides `pitch`; both in Q28.
    fn at(distance_square: i64, pitch: i64) -> Self {
        let spread = ((pitch * i64::from(root(distance_square))) >> SQUARE_BITS).max(1);
        let square = i64::from(ONE) - distance_square - square(pitch) / 6;
        let (near, far) = (i64::from(root(square + spread)), i64::from(root(square - spread)));
        Self {
            mean_inverse_length: (((near - far) << 26) / spread).min(i64::from(i32::MAX)) as i32,
            length: root(i64::from(ONE) - distance_square),
            near_length: near as i32,
            inverse_spread: ((1 << 46) / spread).min(1 << 28) as i32,
        }
    }
}

/// Returns the square of a Q28 number.
const fn square(x: i64) -> i64 {
    (x * x) >> SQUARE_BITS
}

/// Returns the root of a Q28 number; 0 for a negative one.
fn root(x: i64) -> i32 {
    floor_sqrt(x.max(0).unsigned_abs() << SQUARE_BITS) as i32
}

/// Share of the converter's range up to saturation that a peak may use.
const SEEN: f32 = 0.95;
/// Largest undriven level that is subtracted from the range. The level is known only while the scan runs, so the
/// highest allowed one is assumed, up to this limit.
const LEVEL_MAX: i32 = 1_024;
/// Largest [`Params::row_sag_ppb_per_code`] for which a row of `columns` columns, all at the converter's top, has a
/// sag of 0.32: the limit of the boost's series and of 32 bits. Up to ten columns the parameter's own range is
/// smaller.
pub(super) const fn sag_max(columns: usize) -> i32 {
    (320_000_000 / (4_095 * columns)) as i32
}

/// Codes per kPa at the full range, in thousandths: fewer if the characteristic is not a line. Rounded, at most by
/// 5e-4 of them.
pub(super) fn codes_at_full_range(p: &Params) -> Result<i32, ConfigError> {
    let whole = 1_000 + p.curve_permille;
    let codes = (p.codes_per_kpa_milli.unsigned_abs() * 1_000 + whole.unsigned_abs() / 2) / whole.unsigned_abs().max(1);
    if codes < 1_000 {
        let (name, value) = ("codes_per_kpa_milli", p.codes_per_kpa_milli);
        return Err(ConfigError::Param(ParamError { name, value, min: whole, max: 200_000 }));
    }
    Ok(codes as i32)
}

/// Smallest code of a saturated taxel, see [`Params::headroom_codes`].
pub(super) const fn saturated_codes(p: &Params) -> u16 {
    CODE_MAX - p.headroom_codes as u16
}

/// See [`super::Config::force_seen`]. The sag of the row, with which the converter sees more, is ignored.
pub(super) fn force_seen(p: &Params, codes_milli: i32, tip: &Tip) -> Newtons {
    let codes = SEEN * f32::from(saturated_codes(p)) - p.undriven_max_codes.min(LEVEL_MAX) as f32;
    let grown = p.curve_permille as f32 * 1e-3;
    // Load of these codes by [`lanes::Curve`], in codes of the full range.
    let codes = codes * (1.0 + grown * codes / 4_096.0) / (1.0 + grown);
    let peak_kpa = codes / (codes_milli as f32 * 1e-3);
    tip.force(tip.indentation_from_peak(Kilopascals::from_bits(narrow(peak_kpa * exp2(16)))))
}

/// Drift of the array with temperature; see [`crate::control::TemperatureDrift`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayDrift {
    /// Change of the gain per K, Q32.
    pub gain_q32_per_k: i32,
    /// Temperature at which the gain is right, degrees Celsius in Q16.
    pub gain_at_q16: i32,
    /// Change of the whole array's zero per K, N in Q24.
    pub zero_q24_per_k: i32,
}

impl ArrayDrift {
    pub(crate) fn new(p: &Params, [rows, columns]: [usize; 2]) -> Self {
        let taxels = (rows * columns) as i64;
        // um^2 times Pa are 10^-12 N; 16 x 32 taxels of 4 mm at 1,000 Pa are 8.2 N.
        let zero = i64::from(p.array_zero_pa_per_k) * i64::from(p.pitch_um) * i64::from(p.pitch_um);
        Self {
            gain_q32_per_k: ((i64::from(p.array_gain_ppm_per_k) << 32) / 1_000_000) as i32,
            gain_at_q16: p.array_gain_at_c << 16,
            zero_q24_per_k: ((zero * taxels / 1_000) * (1 << 24) / 1_000_000_000) as i32,
        }
    }

    /// Returns true if the array drifts.
    pub(crate) fn on(&self) -> bool {
        self.gain_q32_per_k != 0 || self.zero_q24_per_k != 0
    }
}
