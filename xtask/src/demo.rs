//! The demonstration: the flash image on the virtual board.

use crate::{console::Console, host, image, paths, toolchain::Choice};
use anyhow::Result;
use std::path::PathBuf;

/// Flags of `cargo xtask demo`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cargo xtask demo\n  \
    cargo xtask demo --json target/demo.json --out target/pictures")]
pub struct Args {
    /// Write the figures to this file, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the pictures to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Hold each force for a shorter time, and leave out the second run
    #[arg(long)]
    quick: bool,
}

/// Shows the demonstration on the native core, which is built soon, then on the flash image.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    native(args, console)?;
    let image = image::firmware(choice, console)?;
    console.say(&image.summary());
    let mut command = host::BOARD.build(console)?;
    command.args(["demo", "--image"]).arg(&image.elf);
    for (flag, value) in [("--json", &args.json), ("--out", &args.out)] {
        if let Some(path) = value {
            command.arg(flag).arg(std::path::absolute(path)?);
        }
    }
    command.args(args.quick.then_some("--quick"));
    console.run(&mut command)
}

/// The same script on the core compiled for this machine: something to look at while the emulator compiles.
fn native(args: &Args, console: &mut Console) -> Result<()> {
    let mut command = host::NATIVE_DEMO.build(console)?;
    console.say("First on the native core: the same script and plant, no microcontroller in between.");
    // As it is to be read: programs are started in the root.
    let out = paths::shown(&paths::target().join("demo").join("native"));
    console.run(command.arg("--out").arg(out).args(args.quick.then_some("--quick")))?;
    console.say("Now on the flash image: the emulator is compiled for some minutes, the first time.");
    Ok(())
}
