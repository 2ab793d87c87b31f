//! Which taxels of a row are dead or saturated.

use super::calibration::all;
use crate::config::Config;
use lanes::{SIGNS, codes_at, each_pair, pairs};

/// A bit for each column of a row that is dead or saturated. Any codes and levels are taken.
#[cold]
#[inline(never)]
pub(super) fn bad<const COLUMNS: usize>([codes, undriven]: [&[u16; COLUMNS]; 2], config: &Config) -> u32 {
    let both = |codes: u16| lanes::pair(codes as i16, codes as i16);
    let (dead, sound) = (both(config.dead_codes), both(config.saturated_codes - 1));
    let mut bad = 0;
    each_pair::<COLUMNS>(|at| {
        let (code, undriven) = (codes_at(codes, at), codes_at(undriven, at));
        let net = lanes::sub(code, undriven);
        // The sign of each lane tells whether its taxel is bad; those of the first place are shifted most.
        bad = bad >> 1 | (lanes::sub(net, dead) | lanes::sub(sound, code)) & SIGNS;
    });
    let half = pairs(COLUMNS);
    let first = bad >> (16 - half) & all(half);
    let second = bad >> (32 - half);
    // An odd row's last pair has one column only.
    (first | second << half) & all(COLUMNS)
}
