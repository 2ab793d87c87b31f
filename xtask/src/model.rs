//! The contact model: on the command line, and proven.

use crate::{console::Console, host::Program};
use anyhow::Result;

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
pub fn answer(console: &mut Console) -> Result<()> {
    let mut command = Program::tool("model").build(console)?;
    console.run(&mut command)
}

/// Proves the model's error bounds: some minutes on two cores.
pub fn prove(args: &Args, console: &mut Console) -> Result<()> {
    let flags = [(args.quick, "--quick"), (args.write, "--write"), (args.check, "--check")];
    let mut command = Program::tool("prove").build(console)?;
    console.run(command.args(flags.into_iter().filter_map(|(set, flag)| set.then_some(flag))))
}
