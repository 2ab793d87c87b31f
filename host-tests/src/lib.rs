//! What exercises the fingertip core off the target: the plant, its effects, scenes and metrics.
//!
//! All of it is simulated; nothing here has touched silicon.

#[cfg(feature = "judges")]
pub mod control_table;
#[cfg(feature = "judges")]
pub mod emulator;
#[cfg(feature = "judges")]
pub mod figures;
#[cfg(feature = "judges")]
pub mod fit_cases;
#[cfg(feature = "judges")]
pub mod fit_statistics;
#[cfg(feature = "judges")]
pub mod fit_tables;
#[cfg(feature = "judges")]
pub mod imports;
#[cfg(feature = "judges")]
pub mod long_run;
#[cfg(feature = "judges")]
pub mod model_file;
#[cfg(feature = "judges")]
pub mod native;
pub mod plant;
#[cfg(feature = "judges")]
pub mod prove;
#[cfg(feature = "judges")]
pub mod stimulus;
#[cfg(feature = "judges")]
pub mod study;
