//! Generated files: written anew, or checked for being fresh.

use crate::{
    console::{self, Console},
    paths,
};
use anyhow::{Context, Result, bail};
use std::fs;

/// Files of the repository that a program writes: path, and the arguments of `cargo run` that print its text.
const GENERATED: [(&str, &[&str]); 1] =
    [("docs/control-table.md", &["--package", "host-tests", "--example", "control-table"])];

/// Flags of `cargo xtask docs`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask docs\n  cargo xtask docs --check")]
pub struct Args {
    /// Change nothing; fail where a generated file is stale
    #[arg(long)]
    check: bool,
}

/// Writes or checks the generated files.
///
/// # Errors
/// A generator fails, or a file is stale.
pub fn run(args: &Args, console: &mut Console) -> Result<()> {
    let mut stale = Vec::new();
    for (path, arguments) in GENERATED {
        let text = console::output(console::cargo("run").arg("--quiet").args(arguments))?;
        let file = paths::root().join(path);
        if fs::read_to_string(&file).is_ok_and(|present| present == text) {
            console.say(&format!("fresh    {path}"));
        } else if args.check {
            stale.push(path);
        } else {
            fs::write(&file, text).with_context(|| format!("cannot write {path}"))?;
            console.say(&format!("written  {path}"));
        }
    }
    if !stale.is_empty() {
        bail!("stale: {}; write them anew with `cargo xtask docs`", stale.join(", "));
    }
    Ok(())
}
