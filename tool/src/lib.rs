//! A fingertip controller from the host's side: the bus, the registers by name, and what `fingertip` does with them.
//!
//! [`Client`] talks DYNAMIXEL Protocol 2.0 by the core's own packets; [`table`] finds registers and what their numbers
//! mean in the core's own control table. So neither can differ from the firmware of the same version.

#![allow(missing_docs, reason = "the parts of one program, which only its tests use from elsewhere")]

pub mod captured;
pub mod client;
pub mod commands;
pub mod error;
pub mod line;
pub mod messages;
pub mod numbers;
pub mod state;
pub mod table;
pub mod whole;

pub use client::Client;
pub use error::Error;
