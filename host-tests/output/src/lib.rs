//! Output of the programs on the host: text, pictures and files.

pub mod heatmap;
pub mod kept;
pub mod plot;
pub mod say;
pub mod units;
