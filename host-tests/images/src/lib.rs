//! What the images for an emulated Cortex-M4F share with this machine: recordings, and the same inputs for every
//! function.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

use fingertip::params::Params;

pub mod record;

pub mod same_bits;

pub mod single;

/// What corrects for a real sensor switched on: a characteristic that is no line, creep, a gain that drifts with
/// temperature. The images that count cycles measure what it costs by these.
pub const CORRECTED: Params =
    Params { curve_permille: 3_300, creep_permille: 66, array_gain_ppm_per_k: 3_600, ..Params::DEFAULT };
