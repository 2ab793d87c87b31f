//! `virtual-board sim`: a scene with the flash image.

use sim::cli::Board;
use std::path::PathBuf;
use std::process::ExitCode;
use virtual_board::scene;

/// The image and the scene.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The flash image, an ELF for the STM32F446RE.
    #[arg(long, value_name = "ELF")]
    image: PathBuf,
    #[command(flatten)]
    scene: sim::cli::Args,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> ExitCode {
    sim::cli::answer(&arguments.scene, &|scene, watch| match arguments.scene.board {
        Board::Native => sim::native::board(scene, watch),
        Board::Virtual | Board::Both => scene::simulate(&arguments.image, scene, watch).map_err(Into::into),
    })
}
