//! What accuracy costs in time: inputs for the image `study`, the judge of what it returned, tables and pictures.
//!
//! The image runs every variant on the emulated Cortex-M4F and says what each returned; errors are worked out here,
//! against arbitrary precision, so they are exactly the target's.

pub mod frames;
pub mod front;
pub mod inputs;
pub mod judge;
pub mod kernels;
pub mod output;
pub mod page;
pub mod pictures;
pub mod scan;
pub mod simulation;
