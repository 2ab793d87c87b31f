//! The contact read off the sums.

use crate::config::Config;
use crate::contact::Contact;
use crate::frame::Shape;
use crate::pressure::Picture;
use crate::units::{Millimetres, Newtons};
use fixed::types::I8F24;

/// Fractional bits of a centre of pressure in half pitches.
const RATIO_BITS: u32 = 11;

/// Bits of a sum that leave its largest moment, `side - 1` times as much, 31 with [`RATIO_BITS`].
const fn sum_bits(side: usize) -> u32 {
    if side <= 16 { 16 } else { 15 }
}

/// Reads the contact off the sums.
///
/// The force is the plain sum of the taxels times their area: right to 0.1 % for a contact that the array covers. It is
/// never below zero. The centre is that of the pressure, zero where there is no force.
pub fn from_sums<const ROWS: usize, const COLUMNS: usize>(
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> Contact {
    let force = picture.force(config);
    let centre = if force >= config.contact_off { centre(picture, config) } else { Default::default() };
    of_force(force, centre, picture, config)
}

/// A contact of this force: indentation and radius by the model, the rest by the picture.
pub(super) fn of_force<const ROWS: usize, const COLUMNS: usize>(
    force: Newtons,
    centre: [Millimetres; 2],
    picture: &Picture<ROWS, COLUMNS>,
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

/// Moments over sum in half pitches, as lengths; the resolution is 1/2048 of half a pitch.
#[inline(always)]
fn centre<const ROWS: usize, const COLUMNS: usize>(
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> [Millimetres; 2] {
    // All are shifted alike so that of ten rows and columns the sum keeps 16 bits and the moment, at most nine times as
    // large, 20.
    let shift = (32 - picture.sum.leading_zeros()).saturating_sub(const { sum_bits(Shape::<ROWS, COLUMNS>::SIDE) });
    let sum = (picture.sum >> shift).max(1);
    let half_pitch = i64::from(config.half_pitch.to_bits());
    // Two divisions one after the other; the compiler would make a loop of a closure over both.
    [
        along::<COLUMNS>(picture.moment_x >> shift, sum, half_pitch),
        along::<ROWS>(picture.moment_y >> shift, sum, half_pitch),
    ]
}

#[inline(always)]
fn along<const SIDE: usize>(moment: i32, sum: i32, half_pitch: i64) -> Millimetres {
    let most = (SIDE as i32 - 1) * sum;
    let half_pitches = (moment.max(-most).min(most) << RATIO_BITS) / sum;
    Millimetres(I8F24::from_bits(((i64::from(half_pitches) * half_pitch) >> RATIO_BITS) as i32))
}
