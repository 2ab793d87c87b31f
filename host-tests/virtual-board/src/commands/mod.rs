//! The commands, one module each.

pub mod demo;
pub mod run;
pub mod serve;
pub mod sim;
