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

use crate::angle::sine_cosine;
use crate::touching::{depth, nearest_long_quotient};
use crate::units::{NewtonMillimetres, Radians};
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
