//! The demonstration: the flash image on the virtual board.

use crate::{
    console::{self, Console},
    image,
    toolchain::Choice,
};
use anyhow::Result;
use std::{path::PathBuf, process::Command};

/// Flags of `cargo xtask demo`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cargo xtask demo\n  \
    cargo xtask demo --json target/demo.json --out target/pictures\n  \
    cargo xtask demo --serve --tcp 7000    (then talk to it with any DYNAMIXEL client)")]
pub struct Args {
    /// Write the figures to this file, as JSON
    #[arg(long, value_name = "FILE", conflicts_with = "serve")]
    json: Option<PathBuf>,
    /// Write the pictures to this folder
    #[arg(long, value_name = "DIR", conflicts_with = "serve")]
    out: Option<PathBuf>,
    /// Hold each force for a shorter time, and leave out the second run
    #[arg(long, conflicts_with = "serve")]
    quick: bool,
    /// Keep the board alive for any DYNAMIXEL client, behind a pseudo-terminal or a TCP port
    #[arg(long)]
    serve: bool,
    /// Serve behind this TCP port of this machine; 0 takes any that is free
    #[arg(long, value_name = "PORT", requires = "serve", conflicts_with = "pty")]
    tcp: Option<u16>,
    /// Make a symbolic link of this name to the pseudo-terminal
    #[arg(long, value_name = "PATH", requires = "serve")]
    pty: Option<PathBuf>,
}

/// Builds the flash image and runs it on the virtual board.
///
/// # Errors
/// The image does not build, or the demonstration misses what it must show.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let image = image::firmware(choice, console)?;
    console.say(&image.summary());
    let mut command = virtual_board("run");
    command.arg("--").arg(if args.serve { "serve" } else { "demo" }).arg("--image").arg(&image.elf);
    for (flag, value) in [("--json", &args.json), ("--out", &args.out), ("--pty", &args.pty)] {
        if let Some(path) = value {
            command.arg(flag).arg(std::path::absolute(path)?);
        }
    }
    if let Some(port) = args.tcp {
        command.arg("--tcp").arg(port.to_string());
    }
    if args.quick {
        command.arg("--quick");
    }
    console.run(&mut command)
}

/// `cargo <subcommand>` for the virtual board.
///
/// The emulator's crate asks for a newer compiler than it needs.
pub fn virtual_board(subcommand: &str) -> Command {
    let mut command = console::cargo(subcommand);
    command.args(["--profile", "host", "--package", "virtual-board", "--ignore-rust-version"]);
    command
}
