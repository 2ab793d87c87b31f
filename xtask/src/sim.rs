//! Scenes: one run, or many.

use crate::{
    console::{self, Console},
    demo, image, paths,
    toolchain::Choice,
};
use anyhow::{Context, Result};
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
pub fn sim(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    if !wants_image(&args.arguments) {
        return run("sim", &args.arguments, console);
    }
    let image = image::firmware(choice, console)?;
    console.run(demo::virtual_board("build").arg("--quiet"))?;
    let elf = std::path::absolute(&image.elf)?.display().to_string();
    let arguments = [&["sim".into(), "--image".into(), elf], args.arguments.as_slice()].concat();
    start("virtual-board", &arguments)
}

/// Runs a sweep, on the native board.
///
/// # Errors
/// As [`sim`].
pub fn sweep(args: &Args, console: &mut Console) -> Result<()> {
    run("sweep", &args.arguments, console)
}

/// Whether a board is asked for that runs the flash image.
fn wants_image(arguments: &[String]) -> bool {
    let boards = ["virtual", "both"];
    let pair = arguments.windows(2).any(|pair| pair[0] == "--board" && boards.contains(&pair[1].as_str()));
    let mut joined = arguments.iter().filter_map(|argument| argument.strip_prefix("--board="));
    pair || joined.any(|board| boards.contains(&board))
}

/// Builds a program of the package and starts it.
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
    start(program, arguments)
}

/// Runs a program where the user is; this process ends as it does.
fn start(program: &str, arguments: &[String]) -> Result<()> {
    let path = paths::target().join("host").join(program);
    let status = Command::new(&path).args(arguments).status();
    let status = status.with_context(|| format!("cannot start {}", paths::shown(&path)))?;
    if !status.success() {
        exit(status.code().unwrap_or(2));
    }
    Ok(())
}
