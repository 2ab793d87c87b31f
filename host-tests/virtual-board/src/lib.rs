//! The flash image on an emulated STM32, with the fingertip board around it.
//!
//! The image is the one that is flashed, unmodified, built for the STM32F446RE. It runs on the STM32F427 of the crate
//! `rigless`, whose peripherals the image cannot tell from the F446's. What the image needs and that part lacks is in
//! [`part`]: external triggers, the converters behind the tactile array, the timer's DMA request. The board around
//! it ([`board`], [`front_end`], [`wire`]) ends in the simulated world of `sim`. [`rig::Rig`] runs it all.
//!
//! All of it is simulated; nothing here has touched silicon.

pub mod bench;
pub mod board;
#[cfg(feature = "bringup")]
pub mod bringup;
pub mod client;
pub mod converter;
pub mod demo;
pub mod faults;
pub mod flash;
pub mod front_end;
pub mod image;
pub mod log;
pub mod part;
pub mod report;
pub mod rig;
pub mod scene;
pub mod serve;
pub mod streams;
pub mod timers;
mod window_watchdog;
pub mod wire;

pub use faults::Fault;
pub use rig::{Options, Rig};

use std::path::PathBuf;

/// Reason why a run could not start or continue.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The image could not be read.
    #[error("cannot read the image {}: {source}; build it first (cargo xtask build)", path.display())]
    ReadImage {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not an image for the board.
    #[error("{} is not an image for the board: {why}", path.display())]
    NotAnImage {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
    /// The emulated part does not fit this crate.
    #[error("the emulated part cannot be put together: {0}")]
    Part(#[from] rigless::soc::Error),
    /// The emulator stopped.
    #[error("the emulator stopped at {at_ns} ns: {why}")]
    Emulator {
        /// The last instant that the run is known to have reached.
        at_ns: u64,
        /// Reason reported by the emulator.
        why: String,
    },
    /// A fault could not be injected.
    #[error("cannot inject the fault: {0}")]
    Fault(String),
    /// The client's pseudo-terminal failed.
    #[error("the bus client's pseudo-terminal: {0}")]
    Client(#[from] std::io::Error),
    /// The bring-up image gave no report.
    #[error("the report of the bring-up image: {0}")]
    Report(std::io::Error),
    /// Some of its checks fail.
    #[error("{0} checks fail; see the table")]
    Failed(usize),
    /// The plant was requested, but the board runs in a scene, or the other way round.
    #[error("the world around the board is another one")]
    OtherWorld,
    /// The demonstration has no figures or no pictures.
    #[error(transparent)]
    Demo(#[from] sim::demo::DemoError),
    /// The demonstration misses bounds.
    #[error("{0} of the bounds missed; see the table")]
    Missed(usize),
    /// A scene cannot be simulated.
    #[error(transparent)]
    Scene(#[from] sim::SimError),
    /// The board did not carry out a request of a scene's host.
    #[error("{at_ms:.3} ms after power-on: {why}")]
    Host {
        /// Time since power-on, ms.
        at_ms: f64,
        /// Failure of the board.
        why: String,
    },
    /// The run used features that the emulator lacks and the allow-list does not name.
    #[error("emulator gaps that are not on the allow-list:\n{0}")]
    Gaps(String),
}
