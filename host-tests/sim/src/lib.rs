//! Scenes: simulate only the effects a scene calls for.
//!
//! A scene is a text file (TOML). It says what the finger is made of, what it touches, which forces are asked for and
//! which effects are there. An effect that the scene does not name is not there: it has no state, is never called, and
//! costs nothing.
//!
//! One run goes like this: [`scene`] reads the file; [`registry`] knows every effect by its name and builds those that
//! are named; the world moves the finger and fills the frames; the core's `Pipeline::step` answers each with a duty;
//! everything that wants to see the run watches it step by step ([`watch`]): metrics, ledger, recording, report.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod agreement;
pub mod bridge;
#[cfg(feature = "files")]
pub mod cli;
pub mod cores;
pub mod demo;
pub mod effects;
pub mod events;
#[cfg(feature = "files")]
pub mod explain;
pub mod host;
pub mod key;
pub mod ledger;
pub mod mechanics;
pub mod metrics;
pub mod native;
pub mod optimal;
#[cfg(feature = "files")]
pub mod part;
pub mod plant;
#[cfg(feature = "files")]
pub mod population;
#[cfg(feature = "files")]
pub mod recording;
pub mod registry;
#[cfg(feature = "files")]
pub mod report;
pub mod run;
pub mod scene;
#[cfg(feature = "files")]
pub mod session;
pub mod setup;
#[cfg(feature = "files")]
pub mod sweep;
pub mod watch;
pub mod world;

pub use native::{SimError, simulate};

/// A record's bytes as they are written to flash.
pub fn encode<const ROWS: usize, const COLUMNS: usize>(
    record: &fingertip::store::Record<ROWS, COLUMNS>,
    sequence: u32,
) -> Vec<u8> {
    fingertip::store::words(record, sequence).flat_map(u32::to_le_bytes).collect()
}
