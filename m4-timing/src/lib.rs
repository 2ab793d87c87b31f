//! Estimated cycles of code on a Cortex-M4F: an instruction decoder, the core's timing rules, the STM32F4's flash
//! accelerator, and a plugin that feeds them with what QEMU executes.
//!
//! Everything but the plugin is safe, pure and independent of QEMU. [`core`] lists the rules with their
//! sources; `docs/timing.md` says how far they agree with published measurements.

#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]
#![deny(unsafe_code)]

pub mod core;
pub mod decode;
pub mod instruction;
pub mod meter;

#[cfg(feature = "plugin")]
#[allow(unsafe_code)]
mod plugin;
