//! What the fit knows of the array and the tip before it sees a picture: places, and a table over the distance squared.
//!
//! Lengths are in tip radii. A taxel at the distance r from the contact's centre, with sides h, sees squared distances
//! spread around `r^2 + h^2/6` with the variance `(h r)^2 / 3` whatever its direction. So its mean is taken over
//! squared distances spread evenly over `r^2 + h^2/6 +- h r`, and both parts of the model have closed forms there:
//!
//! - inside the contact, `p/Y = 1 - s G` with `G = (L1 - L2) / (h r)`, the mean of 1/L,
//! - under the rim, `p/Y = (L1 - s)^2 / (2 h r)`,
//!
//! where s is what is left between the plane and the hemisphere's centre, `1 - d`, and
//! `L1 = sqrt(1 - r^2 - h^2/6 + h r)` and `L2 = sqrt(1 - r^2 - h^2/6 - h r)` are the columns' lengths at the near and
//! the far end of the spread.

use crate::arith::floor_sqrt;
use crate::params::Params;

/// Fractional bits of a squared distance, of a column's length and of s.
pub const SQUARE_BITS: u32 = 28;
/// Fractional bits of a taxel's place.
pub const PLACE_BITS: u32 = 15;
/// Squared distance from node to node: 1/128.
pub const NODE_BITS: u32 = SQUARE_BITS - 7;
/// Nodes of the table; the last stands at 1.5, where no contact within the radius reaches a taxel.
pub const NODES: usize = 193;
/// 1 in Q28.
pub const ONE: i32 = 1 << SQUARE_BITS;

/// The model at one distance.
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
    /// How far from the array's middle a contact's centre may lie: a radius beyond its edge along the columns and the
    /// rows, Q24.
    pub(crate) reach: [i32; 2],
    /// 2^56 over the tip's radius in units of its last place.
    pub(crate) inverse_radius: i32,
    /// What a taxel under the pressure Y shows, in sixteenths of a code, Q8.
    pub(crate) modulus_q8: u32,
    /// The model over the squared distance.
    #[doc(hidden)]
    pub nodes: [Node; NODES],
}

impl Geometry {
    /// The geometry that these parameters describe. In integers; they must have been checked.
    pub(crate) fn new(params: &Params, codes_milli: i32, rows: usize, columns: usize) -> Self {
        let (pitch_um, radius_um) = (i64::from(params.pitch_um), i64::from(params.tip_radius_um.max(1)));
        let pitch = ((pitch_um << SQUARE_BITS) / radius_um) as i32;
        let units_q8 = i64::from(params.modulus_pa) * i64::from(codes_milli) * (16 << 8) / 1_000_000;
        let mut nodes = [Node::default(); NODES];
        for (index, node) in nodes.iter_mut().enumerate().skip(1) {
            *node = Node::at((index as i64) << NODE_BITS, i64::from(pitch));
        }
        // At the centre nothing is spread by the distance; a taxel there is under the rim only where the whole contact
        // is smaller than a taxel.
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

/// Middles of so many columns or rows from the array's middle in tip radii, Q15.
pub(crate) fn places<const SIDE: usize>(params: &Params) -> [i32; SIDE] {
    let (pitch_um, radius_um) = (i64::from(params.pitch_um), i64::from(params.tip_radius_um.max(1)));
    let mut places = [0; SIDE];
    for (place, half_pitches) in places.iter_mut().zip((1 - SIDE as i64..).step_by(2)) {
        *place = (((half_pitches * pitch_um) << (PLACE_BITS - 1)) / radius_um) as i32;
    }
    places
}

impl Node {
    /// The model at a squared distance above 0, for taxels with sides `pitch`; both in Q28.
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

/// The square of a Q28 number.
const fn square(x: i64) -> i64 {
    (x * x) >> SQUARE_BITS
}

/// The root of a Q28 number; 0 where it is negative.
fn root(x: i64) -> i32 {
    floor_sqrt(x.max(0).unsigned_abs() << SQUARE_BITS) as i32
}
