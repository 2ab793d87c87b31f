//! Writing the flash image to a board.

use crate::{console::Console, image, paths, toolchain::Choice};
use anyhow::{Result, bail};
use std::process::Command;

/// The part on the board, in probe-rs's words.
const CHIP: &str = "STM32F446RETx";

/// Flags of `cargo xtask flash`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask flash\n  cargo xtask flash --probe 0483:374b")]
pub struct Args {
    /// Which probe, where there are several: VID:PID or VID:PID:serial, as `probe-rs list` shows it
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
}

/// Builds the flash image, prints its SHA-256, writes these bytes, verifies them and starts them.
///
/// # Errors
/// The image does not build, probe-rs is missing, or there is no board.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let image = image::firmware(choice, console)?;
    console.say(&image.summary());
    if paths::find_program("probe-rs").is_none() {
        bail!(
            "probe-rs writes the image to the board, and is not in PATH.\n\
             Install it (`cargo install probe-rs-tools --locked`, or a package from https://probe.rs), or write \
             {} to address {:#010x} with any other tool.",
            paths::shown(&image.bin),
            image.base
        );
    }
    let probe = args.probe.iter().flat_map(|probe| ["--probe", probe]);
    let mut download = Command::new("probe-rs");
    download.args(["download", "--chip", CHIP, "--verify", "--binary-format", "bin", "--base-address"]);
    console.run(download.arg(format!("{:#x}", image.base)).args(probe.clone()).arg(&image.bin))?;
    console.run(Command::new("probe-rs").args(["reset", "--chip", CHIP]).args(probe))?;
    console.say("The board runs the image.");
    Ok(())
}
