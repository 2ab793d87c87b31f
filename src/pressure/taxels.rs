//! Single taxels of a row, where somebody needs them.

use super::{CODE_BITS, GAIN_BITS, TARE_BITS};
use crate::frame::{BANK_COLUMNS, COLUMNS};
use lanes::{BOOST_BITS, Pairs, Row};

/// Writes a row's taxels in sixteenths of a corrected code; tells the highest, at least 0.
#[inline(always)]
pub(super) fn develop(
    [codes, undriven]: [&Pairs; 2],
    row: &Row,
    tare: &[i32; COLUMNS],
    out: &mut [i32; COLUMNS],
) -> i32 {
    let mut peak = 0;
    // The boost in Q22, so that a taxel is the upper half of a product.
    let boost = row.boost >> (GAIN_BITS + BOOST_BITS - CODE_BITS - 32);
    for place in 0..BANK_COLUMNS {
        let net = lanes::sub(codes[place], undriven[place]);
        let gain = row.weights[0][place];
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
