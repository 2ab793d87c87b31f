//! What exercises the fingertip core off the target: the plant, its effects, scenes and metrics.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod native;
pub mod optimal;
pub mod plant;
