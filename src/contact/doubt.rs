//! How far a force is known only from below: 0 not at all, 255 where much of the contact is hidden and nothing says how
//! much.
//!
//! It is a measure and not a verdict, and it comes and goes slowly: a loop that goes by it must not jump where a rim
//! touches the array's edge.

use super::fitted::RATIO_BITS;
use super::{hidden, overhang};
use crate::config::Config;
use crate::contact::Contact;
use crate::pressure::Picture;

/// Ratios of the force to the sum between which a doubtful fit is doubted: from a fifth of the force hidden to two
/// fifths.
const RATIO_DOUBTED: [i32; 2] = [(5 << RATIO_BITS) / 4, (7 << RATIO_BITS) / 4];
/// Shares of the force hidden by bad taxels, Q8, between which the sums are doubted.
const HIDDEN: [i32; 2] = [1 << 5, 1 << 7];
/// Confidences between which a fit is a good likeness.
const CONFIDENCE: [i32; 2] = [96, 160];

/// Of a fit. Where little is hidden, any fit does; where much is, only a good likeness says how much.
pub(super) fn of_fit(ratio: i32, confidence: u8) -> u8 {
    let hidden = ramp(ratio, RATIO_DOUBTED);
    let unlike = u8::MAX - ramp(confidence.into(), CONFIDENCE);
    ((u32::from(hidden) * (u32::from(unlike) + 1)) >> 8) as u8
}

/// Of the sums: none while the rim is within half a pitch of the edge, all from a pitch and a half on; none while bad
/// taxels hide an eighth of the force, all where they hide half of it.
pub(super) fn of_sums<const ROWS: usize, const COLUMNS: usize>(
    sums: &Contact,
    picture: &Picture<ROWS, COLUMNS>,
    config: &Config,
) -> u8 {
    let hidden = ramp(hidden(sums, picture, config).unwrap_or(0).cast_signed(), HIDDEN);
    let half_pitch = config.half_pitch.to_bits() >> 4;
    hidden.max(ramp(overhang::<ROWS, COLUMNS>(sums, config), [half_pitch, 3 * half_pitch]))
}

/// Q8: it comes within some 8 frames and goes within some 64.
pub(super) fn follow(doubt: u32, target: u8) -> u32 {
    let target = u32::from(target) << 8;
    if target > doubt { doubt + (target - doubt).div_ceil(8) } else { doubt - (doubt - target).div_ceil(64) }
}

/// 0 up to `from`, 255 from `to` on, and a line between.
fn ramp(value: i32, [from, to]: [i32; 2]) -> u8 {
    let way = i64::from(value.max(from).min(to)) - i64::from(from);
    (way * 255 / (i64::from(to) - i64::from(from)).max(1)) as u8
}
