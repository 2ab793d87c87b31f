//! What tests, proves and studies the fingertip core off the target; the simulated world is the package `sim`.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod analogue;
pub mod control_table;
pub mod emulator;
pub mod figures;
pub mod finger;
pub mod fit_cases;
pub mod fit_statistics;
pub mod fit_tables;
pub mod long_run;
pub mod model_file;
pub mod page;
pub mod program;
pub mod prove;
pub mod stimulus;
pub mod study;
