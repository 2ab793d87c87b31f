//! Writing the flash image to a board.

use crate::{
    console::Console,
    debugger::Session,
    image::{self, Image},
    option_bytes, paths,
    toolchain::Choice,
};
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

/// Builds the flash image, prints its SHA-256, sees to the option bytes, writes and verifies it, and starts it.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    need_probe_rs()?;
    let image = image::firmware(choice, console)?;
    console.print(&image.summary());
    put(&image, args.probe.as_deref(), console)?;
    console.say("The board runs the image.");
    Ok(())
}

/// Looks for probe-rs before a build, so that nobody waits for an image that cannot be written.
pub fn need_probe_rs() -> Result<()> {
    if paths::find_program("probe-rs").is_some() {
        return Ok(());
    }
    bail!(
        "probe-rs writes the image to the board, and is not in PATH.\n\
         Install it (`cargo install probe-rs-tools --locked`, or a package from https://probe.rs), or let any \
         other tool write the .bin file beside the image that `cargo xtask build` names, to the address printed there."
    );
}

/// Sees to the option bytes, writes and verifies an image, and starts it.
pub fn put(image: &Image, probe: Option<&str>, console: &mut Console) -> Result<()> {
    let command = |subcommand| {
        let mut command = Command::new("probe-rs");
        command.args([subcommand, "--chip", CHIP]).args(probe.iter().flat_map(|probe| ["--probe", probe]));
        command
    };
    // First, because this refuses another device.
    let mut session = Session::open(command("gdb"))?;
    if let Some(options) = option_bytes::check(&mut session)? {
        console.say(&format!("Programming brown-out level 3 into the option bytes ({options:#010x} before)."));
        option_bytes::program(&mut session, options)?;
    }
    drop(session);
    let mut download = command("download");
    download.args(["--verify", "--binary-format", "bin", "--base-address"]);
    console.run(download.arg(format!("{:#x}", image.base)).arg(&image.bin))?;
    console.run(&mut command("reset"))
}
