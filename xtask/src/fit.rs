//! The fit of the contact, judged on many pictures.

use crate::{console::Console, host::Program};
use anyhow::Result;

/// Flags of `cargo xtask fit`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask fit --quick\n  cargo xtask fit --check\n  cargo xtask fit --write")]
pub struct Args {
    /// Cases a series
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    cases: Option<u32>,
    /// Take a twentieth of the cases
    #[arg(long, conflicts_with = "cases")]
    quick: bool,
    /// Write the tables into docs/contact.md instead of printing them
    #[arg(long, conflicts_with_all = ["quick", "cases"])]
    write: bool,
    /// Fail where the tables in docs/contact.md are stale
    #[arg(long, conflicts_with_all = ["quick", "cases", "write"])]
    check: bool,
}

/// Prints the tables, writes or checks them.
pub fn run(args: &Args, console: &mut Console) -> Result<()> {
    let mut command = Program::tool("fit").build(console)?;
    if let Some(cases) = args.cases {
        command.args(["--cases", &cases.to_string()]);
    }
    command.args(args.quick.then_some("--quick"));
    command.args(args.write.then_some("--write"));
    command.args(args.check.then_some("--check"));
    console.run(&mut command)
}
