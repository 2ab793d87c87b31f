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
    #[error("cannot read the image {path}: {1}; build it first (cargo xtask build)", path = .0.display())]
    ReadImage(PathBuf, std::io::Error),
    #[error("{path} is not an image for the board: {1}", path = .0.display())]
    NotAnImage(PathBuf, String),
    /// Another release of `rigless` than this crate is written for.
    #[error("the emulated part cannot be put together: {0}")]
    Part(#[from] rigless::soc::Error),
    /// The last instant that the run is known to have reached, and the emulator's reason.
    #[error("the emulator stopped at {0} ns: {1}")]
    Emulator(u64, String),
    #[error(transparent)]
    Io(#[from] std::io::Error),
    #[error("{0} figures are outside of their bounds; see the table")]
    Failed(usize),
    /// The plant was requested, but the board runs in a scene, or the other way round.
    #[error("the world around the board is another one")]
    OtherWorld,
    #[error(transparent)]
    Demo(#[from] sim::run::RunError),
    #[error(transparent)]
    Scene(#[from] sim::SimError),
    #[error("the board does not answer")]
    Silent,
    #[error("the board refuses with error {0:#04x}")]
    Refused(u8),
    /// Time since power-on, and what the board did not do for a scene's host.
    #[error("{at_ms:.3} ms after power-on: {1}", at_ms = *.0 as f64 * 1e-6)]
    Host(u64, String),
    #[error("emulator gaps that are not on the allow-list:\n{0}")]
    Gaps(String),
}
