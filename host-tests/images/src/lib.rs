//! What the images for an emulated Cortex-M4F share with this machine: recordings, and inputs for functions.
#![no_std]
#![forbid(unsafe_code)]
#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

#[cfg(test)]
extern crate std;

use fingertip::command::Command;
use fingertip::config::Config;
use fingertip::contact::{Contact, FitLevel};
use fingertip::control::{Reference, SpeedLoop};
use fingertip::grip::{Goal, Grip};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, ROWS, TactileImage};
use fingertip::state::Limits;
use fingertip::touch::{Touch, TouchInputs};
use fingertip::units::Millimetres;

pub mod closed_loop;

pub mod record;

pub mod same_bits;

pub mod single;

/// The shipped parameters with a confirmed direction of the motor, because torque is refused without it.
pub const CONFIRMED: Params = Params { direction_confirmed: 1, ..Params::DEFAULT };

/// Parameters with all corrections of a real sensor on: a nonlinear characteristic, creep, and a gain that drifts with
/// temperature. The images that count cycles measure the cost of the corrections with them.
pub const CORRECTED: Params =
    Params { curve_permille: 3_300, creep_permille: 66, array_gain_ppm_per_k: 3_600, ..CONFIRMED };

/// Command of a record for a second controller, which has [`CORRECTED`]: each fit level in turn.
pub fn varied(record: u32, command: &Command) -> Command {
    Command { fit_level: FitLevel::from_number((record / 500 % 6) as u8), ..*command }
}

/// Tactile image of the taxels with its sums, as the pipeline computes it; bad taxels read 0.
pub fn picture(taxels: &[[i32; COLUMNS]; ROWS], bad: [u32; ROWS]) -> TactileImage {
    let mut picture = TactileImage { taxels: *taxels, bad, ..TactileImage::EMPTY };
    for (row, line) in picture.taxels.iter_mut().enumerate() {
        for (column, taxel) in line.iter_mut().enumerate() {
            if bad[row] >> column & 1 != 0 {
                *taxel = 0;
                picture.bad_count += 1;
            }
            picture.sum += *taxel;
            picture.moment_x += *taxel * (2 * column as i32 + 1 - COLUMNS as i32);
            picture.moment_y += *taxel * (2 * row as i32 + 1 - ROWS as i32);
            picture.peak = picture.peak.max(*taxel);
        }
    }
    picture
}

/// Steps touch and grip by a frame of an approach or a hold, without an external force before the array shows one.
#[inline(always)]
pub fn reference(
    grip: &mut Grip,
    goal: Goal,
    contact: &Contact,
    touch: &mut Touch,
    motion: &mut SpeedLoop,
    config: &Config,
    limits: &mut Limits,
) -> Reference {
    let felt = TouchInputs { contact, summed: contact.force, travel: motion.observer.travel, presses: true };
    touch.observe(&felt, || Millimetres::ZERO, config);
    grip.reference(&goal, contact, touch, motion, config, limits)
}
