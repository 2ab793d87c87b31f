//! Scenes: one run, or many.

use crate::{
    console::{self, Console},
    host, image,
    toolchain::Choice,
};
use anyhow::{Context, Result};
use std::process::{Command, exit};

/// What the program behind the command is told; `--help` too.
#[derive(clap::Args)]
pub struct Args {
    /// See `--help`
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    pub arguments: Vec<String>,
}

/// Runs a scene, on the board that is asked for.
pub fn sim(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    on_board("sim", args, choice, console)
}

/// Runs a sweep, on the native board.
pub fn sweep(args: &Args, console: &mut Console) -> Result<()> {
    start(host::Program::sim("sweep").build(console)?.args(&args.arguments))
}

/// Runs a population of drawn fingers, on the board that is asked for.
pub fn population(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    on_board("population", args, choice, console)
}

/// Says what makes the force wrong.
pub fn budget(args: &Args, console: &mut Console) -> Result<()> {
    start(host::Program::sim("budget").build(console)?.args(&args.arguments))
}

/// Runs a program on this machine, or the same command of the board that runs the flash image.
fn on_board(program: &'static str, args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    if !wants_image(&args.arguments) {
        return start(host::Program::sim(program).build(console)?.args(&args.arguments));
    }
    let image = image::firmware(choice, console)?;
    let mut command = host::SCENE_BOARD.build(console)?;
    start(command.arg(program).arg("--image").arg(std::path::absolute(&image.elf)?).args(&args.arguments))
}

/// Whether a board is asked for that runs the flash image.
fn wants_image(arguments: &[String]) -> bool {
    let boards = ["virtual", "both"];
    let pair = arguments.windows(2).any(|pair| pair[0] == "--board" && boards.contains(&pair[1].as_str()));
    let mut joined = arguments.iter().filter_map(|argument| argument.strip_prefix("--board="));
    pair || joined.any(|board| boards.contains(&board))
}

/// Runs a program where the user is; this process ends as it does.
pub fn start(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot start {}", console::show(command)))?;
    if !status.success() {
        exit(status.code().unwrap_or(2));
    }
    Ok(())
}
