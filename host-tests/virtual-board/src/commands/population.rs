//! `virtual-board population`: drawn fingers with the flash image.

use sim::population::cli::{self, Board};
use std::path::PathBuf;
use std::process::ExitCode;
use virtual_board::scene;

/// The image and the population.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The flash image, an ELF for the STM32F446RE.
    #[arg(long, value_name = "ELF")]
    image: PathBuf,
    #[command(flatten)]
    population: cli::Args,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> ExitCode {
    cli::answer(&arguments.population, &|scene, watch| match arguments.population.board {
        Board::Native => sim::native::board(scene, watch),
        Board::Calibrated => sim::native::calibrated::board(scene, watch),
        Board::Virtual => scene::simulate(&arguments.image, scene, watch).map_err(Into::into),
    })
}
