//! The contact model and its fit: on the command line, judged, drawn and proven.

use crate::console::Console;
use crate::host::Program;
use crate::{docs, paths};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Flags of `cargo xtask fit`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask fit --quick\n  cargo xtask fit --check\n  cargo xtask fit --write")]
pub struct FitArgs {
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

impl FitArgs {
    /// Checks the tables.
    pub const CHECK: Self = Self { cases: None, quick: false, write: false, check: true };
}

/// Prints the tables, writes or checks them.
pub fn fit(args: &FitArgs, console: &mut Console) -> Result<()> {
    let mut command = Program::tool("fit").build(console)?;
    if let Some(cases) = args.cases {
        command.args(["--cases", &cases.to_string()]);
    }
    command.args(args.quick.then_some("--quick"));
    command.args(args.write.then_some("--write"));
    command.args(args.check.then_some("--check"));
    console.run(&mut command)
}

/// Flags of `cargo xtask figures`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask figures\n  cargo xtask figures --out /tmp/figures")]
pub struct FiguresArgs {
    /// Folder to draw them into
    #[arg(long, value_name = "DIR", default_value = docs::PICTURES)]
    out: PathBuf,
}

/// Draws the figures.
pub fn figures(args: &FiguresArgs, console: &mut Console) -> Result<()> {
    let default = args.out == Path::new(docs::PICTURES);
    draw(&if default { paths::root().join(docs::PICTURES) } else { args.out.clone() }, console)
}

/// Draws the figures into a folder.
pub fn draw(folder: &Path, console: &mut Console) -> Result<()> {
    let mut command = Program::tool("figures").build(console)?;
    console.run(command.arg(folder))
}

/// Flags of `cargo xtask prove`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask prove --quick\n  cargo xtask prove --check")]
pub struct ProveArgs {
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

impl ProveArgs {
    /// Checks the figures.
    pub const CHECK: Self = Self { quick: false, write: false, check: true };
}

/// Answers rows of CSV on standard input.
pub fn answer(console: &mut Console) -> Result<()> {
    let mut command = Program::tool("model").build(console)?;
    console.run(&mut command)
}

/// Proves the model's error bounds: some minutes on two cores.
pub fn prove(args: &ProveArgs, console: &mut Console) -> Result<()> {
    let flags = [(args.quick, "--quick"), (args.write, "--write"), (args.check, "--check")];
    let mut command = Program::tool("prove").build(console)?;
    console.run(command.args(flags.into_iter().filter_map(|(set, flag)| set.then_some(flag))))
}
