//! What exercises the fingertip core off the target: the plant, its effects, scenes and metrics.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod control_table;
pub mod emulator;
pub mod figures;
pub mod fit_cases;
pub mod fit_statistics;
pub mod fit_tables;
pub mod heatmap;
pub mod imports;
pub mod kept;
pub mod long_run;
pub mod native;
pub mod optimal;
pub mod plant;
pub mod plot;
#[cfg(feature = "judges")]
pub mod prove;
pub mod say;
pub mod stimulus;
#[cfg(feature = "judges")]
pub mod study;
pub mod units;
