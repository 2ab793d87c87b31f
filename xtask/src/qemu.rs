//! The core on an emulated Cortex-M4F.

use crate::{
    apt,
    console::{self, Console},
    host::{self, Program},
    image, paths,
    toolchain::{self, Choice},
};
use anyhow::Result;
use std::path::PathBuf;

const PROGRAM: &str = "qemu-system-arm";

/// Flags of `cargo xtask qemu`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask qemu\n  cargo xtask qemu --inject hang    (fails, as it must)")]
pub struct Args {
    /// Make the image fail, to see it reported
    #[arg(long, value_name = "FAILURE", value_parser = ["panic", "hardfault", "hang"])]
    inject: Option<String>,
}

/// Runs the recorded stimulus and random inputs for every function on the emulator and on the host, and compares.
///
/// # Errors
/// The image does not build, fails, hangs, or differs from the host.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let image = prepare(choice, console)?;
    let [mut replay, mut same_bits] =
        [Program::tool("qemu-host").build(console)?, Program::tool("same-bits").build(console)?];
    console.run(replay.arg(&image).arg(paths::target().join("stimulus")).args(&args.inject))?;
    console.run(same_bits.arg(&image))
}

/// Runs the tests that need the emulator.
///
/// # Errors
/// The image does not build, or a test fails.
pub fn test(choice: Choice, console: &mut Console) -> Result<()> {
    let image = prepare(choice, console)?;
    // Of all packages, like `cargo test`: so nothing is compiled anew with other features.
    let mut command = console::cargo("test");
    command.args(["--test", "qemu", "--", "--ignored"]).env("FINGERTIP_QEMU_IMAGE", image);
    host::test(&mut command, console)
}

/// Makes sure of the emulator.
///
/// # Errors
/// It is missing and cannot be installed.
pub fn ensure(console: &mut Console) -> Result<()> {
    match paths::find_program(PROGRAM) {
        Some(_) => Ok(()),
        // At once the version that the estimates of cycles need: none is installed to be replaced.
        None => apt::newest(&[PROGRAM], "running the core on an emulated Cortex-M4F", console),
    }
}

fn prepare(choice: Choice, console: &mut Console) -> Result<PathBuf> {
    ensure(console)?;
    let toolchain = toolchain::ensure(choice, console)?;
    image::build(toolchain, "qemu", "qemu", console)
}
