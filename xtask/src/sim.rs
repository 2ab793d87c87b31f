//! Simulated fingers: scenes, the demonstration and the bus server.

use crate::console;
use crate::{host, image};
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::{Command, exit};

/// Arguments of the program behind the command; `--help` too.
#[derive(clap::Args)]
pub struct Args {
    /// See `--help`
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    pub arguments: Vec<String>,
}

/// Runs a program on the native board.
pub fn native(program: &'static str, args: &Args) -> Result<()> {
    start(host::Program::sim(program).build()?.args(&args.arguments))
}

/// Runs a program on this machine, or the same command of the board that runs the flash image.
pub fn on_board(program: &'static str, args: &Args) -> Result<()> {
    if !wants_image(&args.arguments) {
        return native(program, args);
    }
    let image = image::firmware()?;
    let mut command = host::SCENE_BOARD.build()?;
    start(command.arg(program).arg("--image").arg(std::path::absolute(&image.elf)?).args(&args.arguments))
}

/// True if the requested board runs the flash image.
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

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cargo xtask demo\n  \
    cargo xtask demo --json target/demo.json --out target/pictures")]
pub struct DemoArgs {
    /// Write the figures to this file, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the pictures to this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Hold each force for a shorter time, and leave out the second run
    #[arg(long)]
    quick: bool,
}

/// Shows the demonstration on the native core, which is built soon, then on the flash image.
pub fn demo(args: &DemoArgs) -> Result<()> {
    let mut command = host::NATIVE_DEMO.build()?;
    console::say("First on the native core: the same script and plant, no microcontroller in between.");
    // As it is to be read: programs are started in the root.
    let out = host::shown(&host::target().join("demo").join("native"));
    console::run(command.arg("--out").arg(out).args(args.quick.then_some("--quick")))?;
    console::say("Now on the flash image: the emulator is compiled for some minutes, the first time.");
    let image = image::firmware()?;
    console::say(&image.summary());
    let mut command = host::BOARD.build()?;
    command.args(["demo", "--image"]).arg(&image.elf);
    host::give_files(&mut command, [("--json", &args.json), ("--out", &args.out)])?;
    command.args(args.quick.then_some("--quick"));
    console::run(&mut command)
}

/// Serves a scene's finger on the native core, or the flash image on the emulated board.
pub fn serve(args: &Args) -> Result<()> {
    // Neither program takes the flag that selects it.
    let board = ["--board", "native", "virtual", "--board=native", "--board=virtual"];
    let words = args.arguments.iter().filter(|word| !board.contains(&word.as_str()));
    if !wants_image(&args.arguments) {
        return start(host::SERVE.build()?.args(words));
    }
    let image = image::firmware()?;
    console::say(&image.summary());
    let mut command = host::BOARD.build()?;
    command.args(["serve", "--image"]).arg(std::path::absolute(&image.elf)?);
    start(command.args(words))
}
