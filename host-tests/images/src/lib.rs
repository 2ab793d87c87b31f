//! What the images for an emulated Cortex-M4F share with this machine: recordings, and the same inputs for every
//! function.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod record;

pub mod same_bits;

pub mod single;
