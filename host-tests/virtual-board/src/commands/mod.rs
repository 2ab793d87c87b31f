//! The commands, one module each.

#[cfg(feature = "bringup")]
pub mod bringup;
pub mod demo;
#[cfg(feature = "scenes")]
pub mod population;
#[cfg(feature = "log")]
pub mod run;
pub mod serve;
#[cfg(feature = "scenes")]
pub mod sim;
