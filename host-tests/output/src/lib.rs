//! What programs on the host say, draw and keep.

pub mod heatmap;
pub mod kept;
pub mod plot;
pub mod say;
pub mod units;
