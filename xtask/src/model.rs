//! The contact model: on the command line, and proven.

use crate::console::{self, Console};
use anyhow::Result;
use std::process::Command;

/// Flags of `cargo xtask prove`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask prove --quick\n  cargo xtask prove --check")]
pub struct Args {
    /// Take a thousandth of the inputs
    #[arg(long)]
    quick: bool,
    /// Write the figures into docs/model.md
    #[arg(long, conflicts_with = "quick")]
    write: bool,
    /// Fail where the figures in docs/model.md are stale
    #[arg(long, conflicts_with_all = ["quick", "write"])]
    check: bool,
}

/// Answers rows of CSV on standard input.
///
/// # Errors
/// A row is outside the domain, or the input is no table.
pub fn answer(console: &mut Console) -> Result<()> {
    console.run(&mut tool("model"))
}

/// Proves the model's error bounds: some minutes on two cores.
///
/// # Errors
/// A bound does not hold, or the figures in the documentation are stale.
pub fn prove(args: &Args, console: &mut Console) -> Result<()> {
    let flags = [(args.quick, "--quick"), (args.write, "--write"), (args.check, "--check")];
    console.run(tool("prove").args(flags.into_iter().filter_map(|(set, flag)| set.then_some(flag))))
}

fn tool(name: &str) -> Command {
    let mut command = console::cargo("run");
    command.args(["--quiet", "--profile", "host", "--package", "host-tests", "--bin", name, "--"]);
    command
}
