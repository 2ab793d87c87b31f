//! The paper's figures, drawn from the core.

use crate::{console::Console, docs, host::Program, paths};
use anyhow::Result;
use std::path::{Path, PathBuf};

/// Flags of `cargo xtask figures`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask figures\n  cargo xtask figures --out /tmp/figures")]
pub struct Args {
    /// Folder to draw them into
    #[arg(long, value_name = "DIR", default_value = docs::PICTURES)]
    out: PathBuf,
}

/// Draws the figures.
pub fn run(args: &Args, console: &mut Console) -> Result<()> {
    let default = args.out == Path::new(docs::PICTURES);
    draw(&if default { paths::root().join(docs::PICTURES) } else { args.out.clone() }, console)
}

/// Draws the figures into a folder.
pub fn draw(folder: &Path, console: &mut Console) -> Result<()> {
    let mut command = Program::tool("figures").build(console)?;
    console.run(command.arg(folder))
}
