//! A simulated finger behind a port, for any client of the bus.

use crate::{console::Console, host, image, sim, toolchain::Choice};
use anyhow::{Result, ensure};
use std::path::PathBuf;

/// Flags of `cargo xtask serve`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  cargo xtask serve --pty /tmp/finger\n  cargo xtask serve raspberry --tcp 7000\n  \
    cargo xtask serve my-scene.toml --set effects.noise.rms_codes=3\n  \
    cargo xtask serve --board virtual --pty /tmp/finger\n\n\
    Commands on standard input move the object or break something: type `help` there."
)]
pub struct Args {
    /// Scene file, or the name of one that `cargo xtask sim --list` shows; `wall` by default
    scene: Option<String>,
    /// Controller to serve
    #[arg(long, value_enum, default_value_t = Board::Native)]
    board: Board,
    /// Symbolic link to the pseudo-terminal
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    pty: Option<PathBuf>,
    /// TCP port of this machine instead of a pseudo-terminal; 0 takes a free one
    #[arg(long, value_name = "PORT")]
    tcp: Option<u16>,
    /// Seed that replaces the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Key of the scene to replace; may be given many times
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    set: Vec<String>,
}

/// What is served.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Board {
    /// The core on this machine, with a scene around it
    Native,
    /// The flash image on the emulated board, in front of a wall
    Virtual,
}

/// Serves a scene's finger on the native core, or the flash image on the emulated board.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let mut command = match args.board {
        Board::Native => {
            let mut command = host::SERVE.build(console)?;
            let seed = args.seed.iter().flat_map(|seed| ["--seed".to_owned(), seed.to_string()]);
            let set = args.set.iter().flat_map(|key| ["--set".to_owned(), key.clone()]);
            command.args(&args.scene).args(seed.chain(set));
            command
        }
        Board::Virtual => {
            let scene = args.scene.is_some() || args.seed.is_some() || !args.set.is_empty();
            ensure!(!scene, "--board virtual takes no scene, no --seed and no --set: its object is a wall");
            let image = image::firmware(choice, console)?;
            console.say(&image.summary());
            let mut command = host::BOARD.build(console)?;
            command.args(["serve", "--image"]).arg(std::path::absolute(&image.elf)?);
            command
        }
    };
    if let Some(link) = &args.pty {
        command.arg("--pty").arg(link);
    }
    if let Some(port) = args.tcp {
        command.args(["--tcp", &port.to_string()]);
    }
    sim::start(&mut command)
}
