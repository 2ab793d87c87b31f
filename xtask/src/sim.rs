//! Scenes: one run, or many.

use crate::{
    console::{self, Console},
    paths,
    toolchain::Choice,
};
use anyhow::{Context, Result, bail};
use std::process::{Command, exit};

/// What the program behind the command is told; `--help` too.
#[derive(clap::Args)]
pub struct Args {
    /// See `--help`
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    arguments: Vec<String>,
}

/// Runs a scene, on the board that is asked for.
///
/// # Errors
/// The board does not build. Where a scene breaks its bounds, this process ends as the board's does.
pub fn sim(args: &Args, _choice: Choice, console: &mut Console) -> Result<()> {
    if wants_virtual(&args.arguments) {
        // The flash image is to run here, with these arguments.
        bail!("the virtual board does not run scenes yet: leave out `--board virtual`");
    }
    run("sim", &args.arguments, console)
}

/// Runs a sweep, on the native board.
///
/// # Errors
/// As [`sim`].
pub fn sweep(args: &Args, console: &mut Console) -> Result<()> {
    run("sweep", &args.arguments, console)
}

fn wants_virtual(arguments: &[String]) -> bool {
    let pair = arguments.windows(2).any(|pair| pair == ["--board", "virtual"]);
    pair || arguments.iter().any(|argument| argument == "--board=virtual")
}

/// Builds a program of the package, and runs it where the user is; this process ends as it does.
fn run(program: &str, arguments: &[String], console: &mut Console) -> Result<()> {
    console.run(console::cargo("build").args([
        "--quiet",
        "--profile",
        "host",
        "--package",
        "sim",
        "--bin",
        program,
    ]))?;
    let path = paths::target().join("host").join(program);
    let status = Command::new(&path).args(arguments).status();
    let status = status.with_context(|| format!("cannot start {}", paths::shown(&path)))?;
    if !status.success() {
        exit(status.code().unwrap_or(2));
    }
    Ok(())
}
