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
mod bus_port;
pub mod client;
mod clock;
pub mod converter;
pub mod demo;
pub mod error;
pub mod faults;
pub mod flash;
pub mod front_end;
pub mod image;
pub mod inside;
pub mod log;
#[cfg(feature = "log")]
pub mod log_text;
pub mod measure;
pub mod part;
pub mod pwm_timer;
pub mod report;
pub mod rig;
pub mod scan_timer;
pub mod scene;
mod sequence;
pub mod serve;
pub mod streams;
pub mod surroundings;
mod window_watchdog;
pub mod wire;

pub use error::Error;
pub use faults::Fault;
pub use rig::{Options, Rig};
