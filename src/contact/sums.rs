//! Efforts 0 and 1: the contact read off the sums.

use crate::config::Config;
use crate::pipeline::Contact;
use crate::pressure::Picture;
use crate::units::Millimetres;
use fixed::types::I8F24;

/// Fractional bits of a centre of pressure in half pitches.
const RATIO_BITS: u32 = 11;

/// Reads the contact off the sums.
///
/// The force is the plain sum of the taxels times their area: right to 0.1 % for a contact that the array covers. It is
/// never below zero. The centre is that of the pressure, zero where there is no force.
pub fn from_sums(picture: &Picture, config: &Config) -> Contact {
    let force = picture.force(config);
    let indentation = config.tip.indentation(force);
    let touching = force >= config.contact_off;
    let centre = |moment| if touching { centre(moment, picture.sum, config) } else { Millimetres::ZERO };
    Contact {
        force,
        indentation,
        centre_x: centre(picture.moment_x),
        centre_y: centre(picture.moment_y),
        radius: config.tip.contact_radius(indentation),
        peak_pa: picture.peak_pa(config),
        confidence: 255,
        bad_taxels: picture.bad_count,
    }
}

/// moment / sum in half pitches, as a length; the resolution is 1/2048 of half a pitch.
fn centre(moment: i32, sum: i32, config: &Config) -> Millimetres {
    // Both are shifted alike so that the sum keeps 16 bits and the moment, at most nine times as large, 20.
    let shift = (32 - sum.leading_zeros()).saturating_sub(16);
    let sum = (sum >> shift).clamp(1, 0xffff);
    let moment = (moment >> shift).clamp(-9 * sum, 9 * sum);
    let half_pitches = (moment << RATIO_BITS) / sum;
    let bits = (i64::from(half_pitches) * i64::from(config.half_pitch.to_bits())) >> RATIO_BITS;
    Millimetres(I8F24::from_bits(bits as i32))
}
