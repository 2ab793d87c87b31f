//! The definition itself: one entry for each register, in the order of the addresses; each file below holds some, and
//! hands them on with those before.
//!
//! As [`control_table`](super::define) reads it:
//! `address NAME: kind[count] access, unit * resolution, least to largest = default, read, write;` with the
//! documentation above. Not listed are the parameters, which follow [`Params`](crate::params::Params) from
//! [`address::PARAMS`] on, 4 bytes each; the [`super::pictures`] of the array, which go by its shape; the
//! [`super::indirect`] registers, and the [`super::mirrors`].
//!
//! From 4096 on, where the pictures of the largest array end, stands what has nothing to do with the array.
//!
//! Addresses below 256 are those of the X-series, with its meaning, but for the mirrors from 148 to 167.

#[macro_use]
mod measured;
#[macro_use]
mod state;
#[macro_use]
mod servo;

use crate::contact::FitLevel;
use crate::link::packet::StatusError;
use crate::link::settings::goal_mn;
use crate::link::snapshot::hardware_error;
use crate::store;

use super::values::{
    bump, permille, set_capture, set_goal, set_measure, set_recover, set_tare, set_torque, set_watchdog, short,
    watchdog,
};
/// The defaults go by no shape.
type Record = store::Record<3, 3>;

use super::{Access, Cell, Kind, Register, Staged, View, thousandths};

/// Model number: the letters FT.
const MODEL: u16 = u16::from_le_bytes(*b"FT");
/// Counts changes of the control table that a host must know of.
const TABLE_VERSION: u32 = 2;
/// Ten times the major and once the minor number of the version.
const FIRMWARE_VERSION: u8 = number(env!("CARGO_PKG_VERSION_MAJOR")) * 10 + number(env!("CARGO_PKG_VERSION_MINOR"));

servo! {}

/// A number of at most two digits.
const fn number(digits: &str) -> u8 {
    match u8::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => 0,
    }
}
