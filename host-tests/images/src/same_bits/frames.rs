//! Frames for the array's reading: a plausible one that changes code by code, with wild codes in between.

use super::Source;
use super::model::Sample;
use fingertip::pressure::{CalibrationError, GAIN_MAX};
use fingertip::shipped::{COLUMNS, Calibration, Frame, ROWS, SLOTS};

/// What a column shows with no row driven.
const LEVEL: u16 = 372;

/// A frame with no load.
pub fn plausible() -> Frame {
    let mut frame = Frame::EMPTY;
    for (slot, column) in (0..SLOTS).flat_map(|slot| (0..COLUMNS).map(move |column| (slot, column))) {
        frame.set_code(slot, column, if slot < ROWS { LEVEL + 40 } else { LEVEL });
    }
    frame
}

/// Changes a code to a plausible one, and one in fifty to any.
pub fn change(frame: &mut Frame, sample: &Sample) {
    let [wild, when, ..] = sample.words;
    let bits = sample.share_q32;
    let place = |bits: u32, count: usize| (((bits & 0xff) * count as u32) >> 8) as usize;
    let (slot, column) = (place(bits, SLOTS), place(bits >> 8, COLUMNS));
    let above = if slot < ROWS { (bits >> 16) as u16 & 0x7ff } else { (bits >> 16) as u16 & 0x1f };
    frame.set_code(slot, column, if when == 0 { wild as u16 } else { LEVEL + above });
}

/// Gains within their range and masks of a few taxels; now and then one that is refused.
pub fn calibration(source: &mut Source) -> Result<Calibration, CalibrationError> {
    let mut gains = [[0; COLUMNS]; ROWS];
    gains.as_flattened_mut().iter_mut().for_each(|gain| *gain = source.within(1, GAIN_MAX.into()) as u16);
    let mut mask = [0; ROWS];
    mask.iter_mut().for_each(|row| *row = source.word() & source.word() & source.word() & 0x3ff);
    match source.up_to(15) {
        0 => mask[3] |= 0x400,
        1 => gains[7][2] = 0,
        2 => gains[2][7] = GAIN_MAX + 1,
        _ => {}
    }
    Calibration::new(&gains, &mask)
}
