//! Bring-up of a board: code that the image of `cargo xtask bringup` and its judge on the host share.
//!
//! The image runs on a bare NUCLEO-F446RE and on the emulated board. It measures, and closes the loop on a finger that
//! it simulates itself ([`script`]); it judges nothing.
#![cfg_attr(target_os = "none", no_std)]

pub mod script;
pub mod text;

#[cfg(feature = "host")]
pub mod checks;
#[cfg(feature = "host")]
pub mod judge;
#[cfg(feature = "host")]
pub mod listen;
