//! What a taxel should read on the plate, step by step: the model's pressure averaged over its square.
//!
//! The square is cut into 3 x 3; in each part the compression is a slope, so the mean over the rim is a parabola as wide
//! as the part's own spread, which takes in the travel of a step too.

use crate::contact::parts::Divisor;

use super::number::{ONE, div, mul, root};
use super::pose::Pose;
use super::series::{STEPS, Series};

/// Parts along a side, and in all.
const SIDE: i64 = 3;
pub const PARTS: u8 = (SIDE * SIDE) as u8;

/// Adds what a part of a taxel reads in shares of Y.
pub fn add_part(
    expected: &mut Series,
    pose: &Pose,
    place: [i64; 2],
    pitch: i64,
    part: u8,
    travel: &[Option<i64>; STEPS],
    step: i64,
) {
    let (across, along) = (i64::from(part) % SIDE - 1, i64::from(part) / SIDE - 1);
    let part = pitch / SIDE;
    let Some(column) = pose.column([place[0] + across * part, place[1] + along * part]) else { return };
    let [x, y] = pose.slope(&column);
    let (x, y) = (mul(x, part / 2), mul(y, part / 2));
    // Half of the compression's spread, as of one that is even.
    let spread = root(mul(x, x) + mul(y, y) + mul(step / 2, step / 2)).max(ONE >> 12);
    let inverse_spread_q20 = i64::from(Divisor::new((4 * spread).unsigned_abs()).divide(ONE, 20));
    let inverse = div(ONE, column.length);
    let share = inverse / (SIDE * SIDE);
    // The tip is round: in the mean over the part that costs as much as a^2 (3 / L^2 - 1) / (24 L) of compression.
    let rounder = mul(mul(part, part), mul(inverse, (3 * mul(inverse, inverse) - ONE) / 16)) * 2 / 3;
    let before = column.length - rounder - ONE - pose.touch + pose.lift(&column);
    for (to, travel) in expected.iter_mut().zip(travel) {
        let Some(travel) = travel else { continue };
        let compressed = before + travel;
        let mean = if compressed >= spread {
            compressed
        } else if compressed > -spread {
            // (c + w)^2 / (4 w)
            let over = compressed + spread;
            (mul(over, over) * inverse_spread_q20) >> 20
        } else {
            0
        };
        *to += mul(mean, share);
    }
}
