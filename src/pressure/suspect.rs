//! Which taxels of a row are dead or saturated.

use super::each;
use crate::frame::{BANK_COLUMNS, SATURATED};
use lanes::{Pairs, SIGNS};

/// A bit for each column of a row that is dead or saturated. Any codes and levels are taken.
#[cold]
#[inline(never)]
pub(super) fn bad([codes, undriven]: [&Pairs; 2], dead_codes: u16) -> u16 {
    let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
    let sound = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
    let mut bad = 0;
    each(|place| {
        let net = lanes::sub(codes[place], undriven[place]);
        // The sign of each lane tells whether its taxel is bad; those of the first place are shifted most.
        bad = bad >> 1 | (lanes::sub(net, dead) | lanes::sub(sound, codes[place])) & SIGNS;
        0
    });
    let first = bad >> (16 - BANK_COLUMNS) & ((1 << BANK_COLUMNS) - 1);
    let second = bad >> (32 - BANK_COLUMNS);
    (first | second << BANK_COLUMNS) as u16
}
