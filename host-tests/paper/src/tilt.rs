//! Beyond one dimension: tilt and tangential displacement, the "additional work" of the paper's last paragraph.
//!
//! Every column is a spring along the normal that also bends sideways with the surface at its foot, so normal
//! approach `d`, tangential shift `s` and tilt `t` of the object share one elastic energy (after Inoue and Hirai's
//! parallel distributed model):
//!
//! ```text
//! P   = pi Y (d^3 / (3 cos^2 t) + d^2 s tan t + d s^2)
//! F_n = dP/dd = pi Y (d^2 / cos^2 t + 2 d s tan t + s^2)
//! F_t = dP/ds = pi Y (d^2 tan t + 2 d s)
//! M   = dP/dt = pi Y (2 d^3 tan t / (3 cos^2 t) + d^2 s / cos^2 t)
//! ```
//!
//! With `s = t = 0` they are the paper's. `1/cos^2 t` is computed as `1 + tan^2 t`.
//!
//! Then friction: the limit surface of a contact with this model's pressure profile. A contact under the normal force N slips
//! when tangential force and moment about the normal leave the ellipse `(f_t / (mu N))^2 + (m / m_max)^2 = 1`. The largest
//! moment is that of friction alone, `m_max = mu integral of r p dS = mu N r_c g(d/a)`, with the shape factor
//!
//! ```text
//! g = 2 (s^3/3 - c (theta - s c)/2) / ((1 - c)^2 s),   c = 1 - d/a = cos(theta),   s = sin(theta)
//! ```
//!
//! which goes from 8/15 for a shallow contact to 0.655 at 0.95 a (a uniform pressure has 2/3, Hertz 0.589).

use crate::touching::{depth, nearest_long_quotient, quotient, radius, sine_cosine, square};
use crate::units::{NewtonMillimetres, Radians, Ratio};
use fingertip::model::Tip;
use fingertip::units::{Millimetres, Newtons};

/// Motion of an object against the tip since the touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Displacement {
    /// Normal approach `d`: 0 to [`Tip::depth_max`].
    pub normal: Millimetres,
    /// Tangential shift `s`: -a/2 to a/2.
    pub shift: Millimetres,
    /// Tilt `t`: -1 to 1 rad.
    pub tilt: Radians,
}

/// Reaction of the tip to a [`Displacement`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// Force along the normal.
    pub normal: Newtons,
    /// Force against the shift.
    pub tangential: Newtons,
    /// Moment against the tilt.
    pub moment: NewtonMillimetres,
}

/// Fractional bits of a tangent.
const TANGENT_BITS: u32 = 46;

/// A displacement within its domain: lengths in Q24, the tangent in Q46.
struct ClampedDisplacement {
    normal: i64,
    shift: i64,
    tangent: i64,
    /// `d^2 / cos^2 t` in Q48.
    square: i64,
}

/// Normal force, tangential force and moment.
///
/// A value outside the ranges of [`Displacement`] counts as the nearest value inside.
pub fn load(tip: &Tip, displacement: Displacement) -> Load {
    let ClampedDisplacement { normal, shift, tangent, square } = pose(tip, displacement);
    let lean = shift_product(normal * normal, tangent, TANGENT_BITS);
    let shear = shift_product(2 * normal * shift, tangent, TANGENT_BITS);
    // 2 d tan t / 3 + s in Q40.
    let arm = shift_product(normal, tangent, TANGENT_BITS - 17).div_euclid(3) + (shift << 16);
    Load {
        normal: Newtons::from_bits(signed_force(tip, square + shear + shift * shift, 0)),
        tangential: Newtons::from_bits(signed_force(tip, lean + 2 * normal * shift, 0)),
        moment: NewtonMillimetres::from_bits(signed_force(tip, shift_product(square, arm, 40), 2)),
    }
}

/// Elastic energy `P` in mJ (N mm); its slopes are the parts of [`load`].
///
/// A value outside the ranges of [`Displacement`] counts as the nearest value inside.
pub fn energy(tip: &Tip, displacement: Displacement) -> NewtonMillimetres {
    let ClampedDisplacement { normal, shift, tangent, square } = pose(tip, displacement);
    // d tan t + s in Q40.
    let lean = shift_product(normal, tangent, TANGENT_BITS - 16) + (shift << 16);
    let sum = square / 3 + shift_product(lean, shift, 16);
    NewtonMillimetres::from_bits(signed_force(tip, shift_product(sum, normal, 24), 2))
}

/// The shift at which a tip that slides freely rests, `s = -(d tan t)/2`: there the energy is least and `F_t` is 0.
///
/// The result may exceed the range of -a/2 to a/2 of [`Displacement::shift`].
pub fn free_shift(tip: &Tip, normal: Millimetres, tilt: Radians) -> Millimetres {
    let pose = pose(tip, Displacement { normal, shift: Millimetres::ZERO, tilt });
    Millimetres::from_bits(-shift_product(pose.normal, pose.tangent, TANGENT_BITS + 1) as i32)
}

fn pose(tip: &Tip, displacement: Displacement) -> ClampedDisplacement {
    let normal = i64::from(depth(tip, displacement.normal));
    let reach = tip.radius().to_bits() / 2;
    let shift = i64::from(displacement.shift.to_bits().max(-reach).min(reach));
    let tilt = displacement.tilt.to_bits().clamp(-1 << 24, 1 << 24);
    let (sine, cosine) = sine_cosine(tilt.unsigned_abs());
    // The cosine of 1 rad is 0.54.
    let steepness = nearest_long_quotient(u128::from(sine) << TANGENT_BITS, cosine.max(1 << 62)) as i64;
    let tangent = if tilt < 0 { -steepness } else { steepness };
    let stretch = (1 << TANGENT_BITS) + shift_product(tangent, tangent, TANGENT_BITS);
    ClampedDisplacement { normal, shift, tangent, square: shift_product(normal * normal, stretch, TANGENT_BITS) }
}

/// `pi Y` times a signed Q48 number, with `drop` bits less after the point than a force has.
fn signed_force(tip: &Tip, wide_q48: i64, drop: u32) -> i32 {
    let magnitude = tip.pi_y_times(wide_q48.unsigned_abs(), drop) as i32;
    if wide_q48 < 0 { -magnitude } else { magnitude }
}

/// `x y / 2^shift`, rounded to nearest.
const fn shift_product(x: i64, y: i64, shift: u32) -> i64 {
    let product = x as i128 * y as i128;
    ((product + (1 << (shift - 1))) >> shift) as i64
}

/// `g` in powers of `d/a`, Q48: Chebyshev fit on 0 to 0.951, off by less than 2e-12. The formula itself cancels at
/// small `d`: three leading terms of its numerator vanish.
const SHAPE: [i64; 14] = [
    150_119_987_578_816,
    21_445_712_593_931,
    8_935_707_931_409,
    3_899_369_952_377,
    1_747_584_930_095,
    816_819_686_429,
    280_788_154_292,
    491_979_478_976,
    -696_515_837_501,
    1_353_226_878_290,
    -1_496_837_092_739,
    1_154_605_172_782,
    -514_206_543_990,
    111_761_483_548,
];

/// The largest share of a limit that is told apart.
const SHARE_MAX: u64 = 1 << 31;

/// Friction limit of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LimitSurface {
    /// The largest tangential force, `mu N`, at no moment.
    pub force: Newtons,
    /// The largest moment about the normal, `m_max`, at no tangential force.
    pub moment: NewtonMillimetres,
}

/// The limit surface at an indentation for a coefficient of friction `mu`, which counts as within 0 to 4.
pub fn limit_surface(tip: &Tip, d: Millimetres, mu: Ratio) -> LimitSurface {
    let depth = depth(tip, d);
    let mu = u64::from(mu.to_bits().clamp(0, 4 << 16).unsigned_abs());
    let area = scale(square(depth), mu, 16);
    let arm = scale(long_radius(tip, depth), shape(tip, depth), 48);
    LimitSurface {
        force: Newtons::from_bits(tip.pi_y_times(area, 0) as i32),
        moment: NewtonMillimetres::from_bits(tip.pi_y_times(scale(area, arm, 40), 2) as i32),
    }
}

/// The shape factor `g = m_max / (mu N r_c)`.
pub fn friction_shape(tip: &Tip, d: Millimetres) -> Ratio {
    Ratio::from_bits((shape(tip, depth(tip, d)) >> 31).div_ceil(2) as i32)
}

/// The contact radius in Q40: the root in Q27, and what its remainder is worth.
fn long_radius(tip: &Tip, depth: u32) -> u64 {
    let square_q54 = (u64::from(depth) * u64::from(2 * radius(tip) - depth)) << 6;
    let root = square_q54.isqrt();
    (root << 13) + quotient((square_q54 - root * root) << 13, 2 * root)
}

/// The shape factor in Q48.
fn shape(tip: &Tip, depth: u32) -> u64 {
    let share_q32 = i128::from(quotient(u64::from(depth) << 32, radius(tip).into()));
    let nested = |sum: i64, coefficient: &i64| coefficient + ((i128::from(sum) * share_q32) >> 32) as i64;
    SHAPE.iter().rev().fold(0, nested).unsigned_abs()
}

impl LimitSurface {
    /// Margin of a load to slip: `1 - sqrt((f_t / (mu N))^2 + (m / m_max)^2)`.
    ///
    /// 1 is no load, 0 is about to slip, below 0 slips. One minus the margin is the share of the limit that is used; it
    /// is told apart up to 180. Where a limit is 0, no load uses nothing of it and any other load all that can be told.
    pub fn margin(&self, tangential: Newtons, moment: NewtonMillimetres) -> Ratio {
        let force_share = share(tangential.to_bits(), self.force.to_bits());
        let moment_share = share(moment.to_bits(), self.moment.to_bits());
        let used_q24 = (force_share * force_share + moment_share * moment_share).isqrt();
        Ratio::from_bits((1 << 16) - (used_q24 >> 7).div_ceil(2) as i32)
    }
}

/// Size of a load over its limit, in Q24, at most [`SHARE_MAX`].
fn share(load: i32, limit: i32) -> u64 {
    let load = u64::from(load.unsigned_abs());
    match u64::from(limit.unsigned_abs()) {
        0 => load * SHARE_MAX,
        limit => quotient(load << 24, limit),
    }
    .min(SHARE_MAX)
}

/// `x y / 2^shift`, rounded to nearest.
const fn scale(x: u64, y: u64, shift: u32) -> u64 {
    ((x as u128 * y as u128 + (1 << (shift - 1))) >> shift) as u64
}
