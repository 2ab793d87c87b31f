//! The picture to a contact: total force, centre, indentation and radius, and how far the picture is a contact at all.
//!
//! Where the array sees the whole contact, the sum of the taxels is its force and their moments are its centre. Where
//! it does not, because the contact reaches over the array's edge or over a bad taxel, the paper's model is fitted to
//! the taxels that do see it, by [`Fit`] from frame to frame. `docs/contact.md` gives the method and the measured errors.

mod arith;
mod doubt;
mod fit_level;
mod fitted;
mod follow;
mod guess;
mod order;
mod reading;
mod step;
mod sums;
mod view;

pub use fit_level::FitLevel;
pub use follow::Fit;
pub use reading::Contact;
pub use sums::from_sums;

use crate::config::Config;
use crate::pressure::Picture;
use step::{Bits, Misfit};
use view::Scale;

/// What the fit is made of, for other ways to read a picture that it is measured against. It may change at any time.
#[doc(hidden)]
pub mod parts {
    pub use super::arith::{Divisor, between, clamp_to, high, root};
    pub use super::guess::{CENTRE_BITS, Guess, Prediction, SLOPE_BITS, interval};
    pub use super::step::{Comparison, Equations, Misfit};
    pub use super::view::{PEAK_BITS, Scale, View};
    pub use super::{TAXELS_MIN, confidence, covers};
    pub use crate::config::geometry::{ONE, PLACE_BITS, SQUARE_BITS};
}

/// A contact with less confidence than this is not a hemisphere on a plane.
pub const CONFIDENCE_LEAST: u8 = 128;
/// Root mean square residual, as a share of the peak in Q14, at which confidence reaches 0: 2.8 %.
const RESIDUAL_MAX: u32 = 459;
/// Fewer live taxels than this within the contact cannot hold the model's three unknowns against noise.
pub const TAXELS_MIN: i32 = 5;

/// How far a contact reaches over the array's edge; below 0 where it does not. In 2^-20 mm: 24 bits hold 128 mm, half a
/// unit of these is 8 nm, and nothing overflows.
fn overhang<const ROWS: usize, const COLUMNS: usize>(contact: &Contact, config: &Config) -> i32 {
    let [x, y, radius, half_pitch] =
        [contact.centre_x, contact.centre_y, contact.radius, config.half_pitch].map(|length| length.to_bits() >> 4);
    let [x, y] = [x.abs(), y.abs()];
    // The sides of a square are equally far: only for it the farther coordinate decides.
    if ROWS == COLUMNS {
        return x.max(y) + radius - COLUMNS as i32 * half_pitch;
    }
    (x - COLUMNS as i32 * half_pitch).max(y - ROWS as i32 * half_pitch) + radius
}

/// Whether the whole contact lies on good taxels of the array.
pub fn covers<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> bool {
    overhang::<ROWS, COLUMNS>(contact, config) <= 0 && hidden(contact, picture, config).is_none()
}

/// The share of a contact's force that bad taxels hide, Q8; none where none of them is within reach of it.
///
/// The pressure is taken for a parabola over the radius, whose mean is half of its peak: a taxel of the area A at the
/// distance r from the centre has the share 2 A (1 - r^2 / r_c^2) / (pi r_c^2).
#[inline(never)]
fn hidden<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> Option<u32> {
    if picture.bad.iter().all(|bad| *bad == 0) {
        return None;
    }
    // In 2^-7 mm: squares of 128 mm fit 28 bits.
    let [x, y, radius, half_pitch] = [contact.centre_x, contact.centre_y, contact.radius, config.half_pitch]
        .map(|length| ((length.to_bits() >> 16) + 1) >> 1);
    // A bad taxel whose middle is nearer than the rim and half of its own diagonal may hide pressure.
    let reach = radius + half_pitch + (half_pitch >> 1);
    let square = (radius * radius).max(1);
    let mut rest: Option<i32> = None;
    for (row, bad) in picture.bad.iter().enumerate() {
        let mut left = *bad;
        let dy = (2 * row as i32 + 1 - ROWS as i32) * half_pitch - y;
        while left != 0 {
            let dx = (2 * left.trailing_zeros() as i32 + 1 - COLUMNS as i32) * half_pitch - x;
            let distance = dx * dx + dy * dy;
            if distance < reach * reach {
                rest = Some(rest.unwrap_or(0).saturating_add((square - distance).max(0)));
            }
            left &= left - 1;
        }
    }
    // Over the square of the radius: the pressures of the taxels in Q8, and the share of a taxel in the middle in Q16.
    // 8 / pi in Q8 is 652. No division is wider than 32 bits.
    let square = (square >> 8).max(1);
    rest.map(|rest| {
        let middle = half_pitch * half_pitch * 652 / square;
        ((i64::from(rest / square) * i64::from(middle)) >> 16).min(1 << 8) as u32
    })
}

/// 255 at no residual, falling to 0 at `RESIDUAL_MAX`; what the converter's steps leave does not count.
pub fn confidence<const ROWS: usize, const COLUMNS: usize>(misfit: &Misfit, scale: &Scale) -> u8 {
    let mean = |squares: i32, taxels: i32| squares.max(0).unsigned_abs() / taxels.max(1).unsigned_abs();
    // Squares count fewer bits than a share's square.
    let drop = Bits::<ROWS, COLUMNS>::ALL;
    let larger = mean(misfit.inside, misfit.taxels).max(mean(misfit.outside, misfit.others));
    let mean = larger.min(u32::MAX >> drop) << drop;
    let residual = arith::root(mean.saturating_sub(scale.converter_square()));
    (255 - (residual * 255 / RESIDUAL_MAX).min(255)) as u8
}
