//! From the tactile image to a contact: total force, centre, indentation and radius, and the likeness of the image to
//! a contact.
//!
//! If the array sees the whole contact, the sum of the taxels is its force and their moments are its centre. If it
//! does not, because the contact reaches over the array's edge or over a bad taxel, the paper's model is fitted to
//! the taxels that do see it, by [`Fit`] from frame to frame. `docs/contact.md` gives the method and the measured
//! errors.

mod equations;
mod fit;

pub use fit::Fit;

use crate::config::Config;
use crate::frame::Shape;
use crate::pressure::TactileImage;
use crate::units::{Millimetres, Newtons};
use equations::{Bits, Misfit, PeakScale};
use fixed::types::I8F24;

/// Parts of the fit, for other methods that are compared with it. They may change at any time.
#[doc(hidden)]
pub mod parts {
    pub use super::equations::{
        CENTRE_BITS, Comparison, Equations, Guess, Misfit, PEAK_BITS, PeakScale, Prediction, SLOPE_BITS, ScaledImage,
        interval,
    };
    pub use super::{TAXELS_MIN, confidence, covers};
    pub use crate::arith::{Divisor, between, clamp_to, high, root};
    pub use crate::config::array::{ONE, PLACE_BITS, SQUARE_BITS};
}

/// Least confidence at which a contact counts as a hemisphere on a plane.
pub const CONFIDENCE_LEAST: u8 = 128;
/// Root mean square residual, as a share of the peak in Q14, at which confidence reaches 0: 2.8 %.
const RESIDUAL_MAX: u32 = 459;
/// Least number of live taxels within the contact: fewer cannot hold the model's three unknowns against noise.
pub const TAXELS_MIN: i32 = 5;

/// Contact in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Total normal force.
    pub force: Newtons,
    /// Indentation of the tip, from the force by the model.
    pub indentation: Millimetres,
    /// Centre of pressure along the columns, from the array's middle.
    pub centre_x: Millimetres,
    /// Centre of pressure along the rows, from the array's middle.
    pub centre_y: Millimetres,
    /// Contact radius, by the model.
    pub radius: Millimetres,
    /// Highest pressure on a taxel, Pa.
    pub peak_pa: u32,
    /// Likeness of the image to a hemisphere on a plane: 0 none, 255 full.
    pub confidence: u8,
    /// Uncertainty of the force: 0 none; 255 if much of the contact is hidden and no fit shows how much. Such a force
    /// is known only from below.
    pub doubt: u8,
    /// Number of taxels left out because they are dead or saturated; 255 means 255 or more.
    pub bad_taxels: u8,
}

/// Amount of work per frame for the contact. The numbers are stable: hosts store them.
///
/// A refinement of the model takes each row of the array once. The fit level limits the rows in a frame. A refinement
/// that is spread over frames begins in a separate frame. The periods below are for ten rows; an array with fewer
/// rows than the level allows has all of them in every frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum FitLevel {
    /// Force by the sum of the taxels; the centre stays at the array's middle.
    Sum = 0,
    /// Force by the sum, centre by the moments.
    Moments = 1,
    /// The model, a row a frame: refined every 11th frame.
    #[default]
    OneRow = 2,
    /// The model, two rows a frame: refined every 6th frame.
    TwoRows = 3,
    /// The model, five rows a frame: refined every 3rd frame.
    FiveRows = 4,
    /// The model, all rows and their solution in every frame.
    AllRows = 5,
}

impl FitLevel {
    /// All fit levels, least first.
    pub const ALL: [Self; 6] = [Self::Sum, Self::Moments, Self::OneRow, Self::TwoRows, Self::FiveRows, Self::AllRows];

    /// Returns the fit level of a number; the largest for an unknown number.
    pub const fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Sum,
            1 => Self::Moments,
            2 => Self::OneRow,
            3 => Self::TwoRows,
            4 => Self::FiveRows,
            _ => Self::AllRows,
        }
    }

    /// Returns the next lower level, or the least.
    pub const fn lower(self) -> Self {
        Self::from_number((self as u8).saturating_sub(1))
    }

    /// Returns the next higher level, or the largest.
    pub const fn higher(self) -> Self {
        Self::from_number(self as u8 + 1)
    }

    /// Number of rows that the model takes in a frame at most, of an array with `all` rows.
    pub(crate) const fn rows(self, all: usize) -> usize {
        let rows = match self {
            Self::Sum | Self::Moments => 0,
            Self::OneRow => 1,
            Self::TwoRows => 2,
            Self::FiveRows => 5,
            Self::AllRows => all,
        };
        if rows < all { rows } else { all }
    }
}

/// Fractional bits of a centre of pressure in half pitches.
const CENTRE_RATIO_BITS: u32 = 11;

/// Bits of a sum such that its largest moment, `side - 1` times as much, takes 31 bits with [`CENTRE_RATIO_BITS`].
const fn sum_bits(side: usize) -> u32 {
    if side <= 16 { 16 } else { 15 }
}

/// Computes the contact from the sums.
///
/// The force is the plain sum of the taxels times their area: right to 0.1 % for a contact that the array covers. It
/// is never below zero. The centre is that of the pressure, zero without a force.
pub fn from_sums<const ROWS: usize, const COLUMNS: usize>(
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> Contact {
    let force = picture.force(config);
    let centre = if force >= config.contact_off { centre_of_pressure(picture, config) } else { Default::default() };
    contact_of_force(force, centre, picture, config)
}

/// Completes a contact of this force: indentation and radius by the model, the rest from the image.
fn contact_of_force<const ROWS: usize, const COLUMNS: usize>(
    force: Newtons,
    centre: [Millimetres; 2],
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> Contact {
    let indentation = config.tip.indentation(force);
    let [centre_x, centre_y] = centre;
    Contact {
        force,
        indentation,
        centre_x,
        centre_y,
        radius: config.tip.contact_radius(indentation),
        peak_pa: picture.peak_pa(config),
        confidence: 255,
        doubt: 0,
        bad_taxels: picture.bad_count.min(u16::from(u8::MAX)) as u8,
    }
}

/// Centre of pressure as moments over sum; the resolution is 1/2048 of half a pitch.
#[inline(always)]
fn centre_of_pressure<const ROWS: usize, const COLUMNS: usize>(
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> [Millimetres; 2] {
    // All are shifted alike. With ten rows and columns the sum keeps 16 bits and the moment, at most nine times as
    // large, 20.
    let shift = (32 - picture.sum.leading_zeros()).saturating_sub(const { sum_bits(Shape::<ROWS, COLUMNS>::SIDE) });
    let sum = (picture.sum >> shift).max(1);
    let half_pitch = i64::from(config.half_pitch.to_bits());
    // Two divisions in sequence; the compiler would make a loop of a closure over both.
    [
        along::<COLUMNS>(picture.moment_x >> shift, sum, half_pitch),
        along::<ROWS>(picture.moment_y >> shift, sum, half_pitch),
    ]
}

#[inline(always)]
fn along<const SIDE: usize>(moment: i32, sum: i32, half_pitch: i64) -> Millimetres {
    let most = (SIDE as i32 - 1) * sum;
    let half_pitches = (moment.max(-most).min(most) << CENTRE_RATIO_BITS) / sum;
    Millimetres(I8F24::from_bits(((i64::from(half_pitches) * half_pitch) >> CENTRE_RATIO_BITS) as i32))
}

/// Distance by which a contact reaches over the array's edge; negative inside the array. In 2^-20 mm: 24 bits hold
/// 128 mm, half a unit is 8 nm, and nothing overflows.
fn overhang<const ROWS: usize, const COLUMNS: usize>(contact: &Contact, config: &Config) -> i32 {
    let [x, y, radius, half_pitch] =
        [contact.centre_x, contact.centre_y, contact.radius, config.half_pitch].map(|length| length.to_bits() >> 4);
    let [x, y] = [x.abs(), y.abs()];
    // The sides of a square are equally far, so the farther coordinate decides.
    if ROWS == COLUMNS {
        return x.max(y) + radius - COLUMNS as i32 * half_pitch;
    }
    (x - COLUMNS as i32 * half_pitch).max(y - ROWS as i32 * half_pitch) + radius
}

/// Returns true if the whole contact lies on good taxels of the array.
pub fn covers<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> bool {
    overhang::<ROWS, COLUMNS>(contact, config) <= 0 && hidden(contact, picture, config).is_none()
}

/// Share of a contact's force that bad taxels hide, Q8; none if no bad taxel is within reach of it.
///
/// The pressure is taken for a parabola over the radius, whose mean is half of its peak: a taxel of the area A at the
/// distance r from the centre has the share 2 A (1 - r^2 / r_c^2) / (pi r_c^2).
#[inline(never)]
fn hidden<const ROWS: usize, const COLUMNS: usize>(
    contact: &Contact,
    picture: &TactileImage<ROWS, COLUMNS>,
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

/// Confidence: 255 at no residual, falling to 0 at `RESIDUAL_MAX`. The part of the residual that the converter's
/// resolution explains is ignored.
pub fn confidence<const ROWS: usize, const COLUMNS: usize>(misfit: &Misfit, scale: &PeakScale) -> u8 {
    let mean = |squares: i32, taxels: i32| squares.max(0).unsigned_abs() / taxels.max(1).unsigned_abs();
    // Squares count fewer bits than a share's square.
    let drop = Bits::<ROWS, COLUMNS>::ALL;
    let larger = mean(misfit.inside, misfit.taxels).max(mean(misfit.outside, misfit.others));
    let mean = larger.min(u32::MAX >> drop) << drop;
    let residual = crate::arith::root(mean.saturating_sub(scale.converter_square()));
    (255 - (residual * 255 / RESIDUAL_MAX).min(255)) as u8
}
