//! The contact model: on the command line, and proven.

use crate::console::{self, Console};
use anyhow::Result;
use std::process::Command;

/// Flags of `cargo xtask prove`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask prove --quick\n  cargo xtask prove")]
pub struct Args {
    /// Take a thousandth of the inputs
    #[arg(long)]
    quick: bool,
}

/// Answers rows of CSV on standard input.
///
/// # Errors
/// A row is outside the domain, or the input is no table.
pub fn answer(console: &mut Console) -> Result<()> {
    console.run(&mut tool("model"))
}

/// Proves the model's error bounds.
///
/// # Errors
/// A bound does not hold.
pub fn prove(args: &Args, console: &mut Console) -> Result<()> {
    console.run(tool("prove").args(args.quick.then_some("--quick")))
}

fn tool(name: &str) -> Command {
    let mut command = console::cargo("run");
    command.args(["--quiet", "--profile", "host", "--package", "host-tests", "--bin", name, "--"]);
    command
}
