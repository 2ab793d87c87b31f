#![doc = include_str!("README.md")]
//!
//! # Reading on
//!
//! Each module uses only those declared before it. [`pipeline`] begins with the path of a frame, stage by stage, from
//! the converter's codes to the bridge. After configuration, floating point only estimates square roots: the speed
//! profile takes one as the FPU gives it, all others are corrected in integers.
#![no_std]
#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![allow(
    clippy::manual_clamp,
    reason = "`clamp` panics where its bounds are out of order; the step must not be able to"
)]

#[cfg(test)]
extern crate std;

pub use fixed;

pub mod units;
pub mod arith;
pub mod params;
pub mod model;
pub mod frame;
pub mod scan;
pub mod chip;
pub mod config;
pub mod state;
pub mod pressure;
pub mod contact;
pub mod touch;
pub mod command;
pub mod control;
pub mod measure;
pub mod grip;
pub mod safety;
pub mod status;
pub mod pipeline;
pub mod capture;
pub mod store;
pub mod link;
pub mod shipped;
