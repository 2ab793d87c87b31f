//! Bring-up of a board: code that the image of `cargo xtask bringup` and its judge on the host share.
//!
//! The image runs on a bare NUCLEO-F446RE and on the emulated board. It measures, and closes the loop on a finger that
//! it simulates itself ([`script`]); it judges nothing.
//!
//! The lines between image and host: `bringup VERSION UID`, `figure NAME VALUE`, `cycles MEDIAN MOST KERNEL`, and `end
//! CHECK`, a check over all before it. A line that begins with `#` only reports progress.
#![cfg_attr(target_os = "none", no_std)]
#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

pub mod script;

#[cfg(feature = "host")]
pub mod checks;
#[cfg(feature = "host")]
pub mod judge;
#[cfg(feature = "host")]
pub mod listen;

/// Version of these lines.
pub const VERSION: u32 = 1;
/// The virtual COM port's speed.
pub const BAUD: u32 = 115_200;
/// Line that the image repeats while it waits for the host's `go`.
pub const READY: &str = "ready: send `go` and a line's end, or `go FRAMES`";
/// Default number of frames for which the rows are read back.
pub const FRAMES: u32 = 1_000_000;

/// The check over nothing.
pub const CHECK: u32 = 0x811C_9DC5;

/// The check over one byte more: FNV-1a.
pub const fn checked(check: u32, byte: u8) -> u32 {
    (check ^ byte as u32).wrapping_mul(0x0100_0193)
}

/// Parses the host's line; returns the number of frames that it requests.
pub fn asked_frames(line: &str) -> Option<u32> {
    let rest = line.trim().strip_prefix("go")?;
    if rest.is_empty() { Some(FRAMES) } else { rest.trim().parse().ok() }
}
