//! Single taxels of a row, where somebody needs them.

use super::calibration::Gains;
use super::row::{CODE_MAX, held};
use super::{BOOST_BITS, CODE_BITS, GAIN_BITS, TARE_BITS};
use crate::frame::{BANK_COLUMNS, COLUMNS, SATURATED};
use lanes::Pairs;

/// Writes a row's taxels in sixteenths of a corrected code; tells the highest, at least 0.
#[inline(always)]
pub(super) fn develop(
    [codes, undriven]: [&Pairs; 2],
    gains: &Gains,
    boost: i32,
    tare: &[i32; COLUMNS],
    out: &mut [i32; COLUMNS],
) -> i32 {
    let mut peak = 0;
    // The boost in Q22, so that a taxel is the upper half of a product.
    let boost = boost >> (GAIN_BITS + BOOST_BITS - CODE_BITS - 32);
    for place in 0..BANK_COLUMNS {
        let net = lanes::sub(codes[place], held(undriven[place]));
        let gain = gains.weights[0][place];
        let left = taxel(lanes::low(net), lanes::low(gain), boost, tare[place]);
        let right = taxel(lanes::high(net), lanes::high(gain), boost, tare[place + BANK_COLUMNS]);
        out[place] = left;
        out[place + BANK_COLUMNS] = right;
        peak = peak.max(left).max(right);
    }
    peak
}

/// Net code, gain in Q14 and boost in Q22 to sixteenths above the tare in Q16, rounded once.
#[inline(always)]
fn taxel(net: i16, gain: i16, boost: i32, tare: i32) -> i32 {
    let gained = i32::from(net) * i32::from(gain);
    let boosted = (i64::from(gained) * i64::from(boost) + (1 << 31)) >> 32;
    boosted as i32 - (tare >> (TARE_BITS - CODE_BITS))
}

/// Sum of a row's net codes, whatever they are, within what a sound row can have.
#[cold]
#[inline(never)]
pub(super) fn net_sum(codes: &Pairs, undriven: &Pairs) -> u32 {
    let mut sum = 0;
    for (codes, undriven) in codes.iter().zip(undriven) {
        sum = lanes::dot(lanes::sub(*codes, held(*undriven)), lanes::pair(1, 1), sum);
    }
    sum.unsigned_abs().min(COLUMNS as u32 * u32::from(CODE_MAX))
}

/// The dead and saturated columns of a row, a bit each.
#[cold]
#[inline(never)]
pub(super) fn bad(codes: &Pairs, undriven: &Pairs, dead_codes: u16) -> u16 {
    let mut bad = 0;
    for place in 0..BANK_COLUMNS {
        let net = lanes::sub(codes[place], held(undriven[place]));
        let wrong = signs(net, codes[place], dead_codes);
        // The low lane's sign to bit 0, the high lane's to bit 5.
        bad |= (wrong >> 15 & 1 | wrong >> (31 - BANK_COLUMNS) & 1 << BANK_COLUMNS) << place;
    }
    bad as u16
}

/// The sign bit of each lane tells whether its taxel is dead or saturated.
fn signs(net: u32, codes: u32, dead_codes: u16) -> u32 {
    let dead = lanes::pair(dead_codes as i16, dead_codes as i16);
    let sound = lanes::pair(SATURATED as i16 - 1, SATURATED as i16 - 1);
    lanes::sub(net, dead) | lanes::sub(sound, codes)
}

/// Takes bad taxels out of a row; tells the highest of the others, at least 0.
#[cold]
#[inline(never)]
pub(super) fn leave_out(bad: u16, taxels: &mut [i32; COLUMNS]) -> i32 {
    let mut peak = 0;
    for (column, taxel) in taxels.iter_mut().enumerate() {
        if bad >> column & 1 != 0 {
            *taxel = 0;
        }
        peak = peak.max(*taxel);
    }
    peak
}
