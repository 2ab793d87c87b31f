//! Which taxels of a row are dead or saturated, and what such ones have in the sums.

use super::row::weight;
use super::{CODE_BITS, TARE_BITS, each};
use crate::frame::{BANK_COLUMNS, COLUMNS, SATURATED};
use lanes::{Pairs, Row, SIGNS};

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

/// Makes taxels of a row, a bit each, zero; the highest of them, at least 0.
pub(super) fn clear(columns: u16, taxels: &mut [i32; COLUMNS]) -> i32 {
    let mut highest = 0;
    let mut left = u32::from(columns);
    while left != 0 {
        let taxel = &mut taxels[(left.trailing_zeros() as usize).min(COLUMNS - 1)];
        highest = highest.max(core::mem::take(taxel));
        left &= left - 1;
    }
    highest
}

/// What some taxels of a row have in its sums.
#[derive(Default)]
pub(super) struct Share {
    /// In its two sums of net codes.
    pub sums: [i32; 2],
    /// In the tare, and its moment, in sixteenths.
    pub tares: [i32; 2],
}

impl Share {
    /// Of some columns, a bit each.
    pub fn new(columns: u16, [codes, undriven]: [&Pairs; 2], row: &Row) -> Self {
        let mut share = Self::default();
        let [sum, moment] = &mut share.sums;
        let [tare_sum, tare_moment] = &mut share.tares;
        let mut left = u32::from(columns);
        while left != 0 {
            let column = (left.trailing_zeros() as usize).min(COLUMNS - 1);
            left &= left - 1;
            let place = column % BANK_COLUMNS;
            let lane = if column < BANK_COLUMNS { 0xffff } else { 0xffff_0000 };
            let net = lanes::sub(codes[place], undriven[place]) & lane;
            *sum = lanes::dot(net, row.gains[place], *sum);
            *moment = lanes::dot(net, row.moments[place], *moment);
            let tare = row.tare[column] >> (TARE_BITS - CODE_BITS);
            *tare_sum += tare;
            *tare_moment += tare * weight(column);
        }
        share
    }
}
