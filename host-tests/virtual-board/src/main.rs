//! `virtual-board`: the flash image on the emulated board.

mod commands;

use clap::{Parser, Subcommand};
use serve::Place;
use sim::plant::Setup;
use std::path::PathBuf;
use std::process::ExitCode;
#[cfg(feature = "scenes")]
use virtual_board::scene::simulate;

/// Runs the flash image on an emulated STM32 with the simulated fingertip around it.
#[derive(Debug, Parser)]
#[command(name = "virtual-board", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs the image for some time and reports speed, frames, log and emulator gaps.
    #[cfg(feature = "log")]
    Run {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long)]
        image: PathBuf,
        /// Virtual time to run, ms.
        #[arg(long, default_value_t = 1_000)]
        ms: u64,
    },
    /// Runs the image of `cargo xtask bringup` and judges its report.
    #[cfg(feature = "bringup")]
    Bringup {
        /// The image, an ELF.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Number of frames for which the rows are read back.
        #[arg(long, default_value_t = 1_000)]
        frames: u32,
        /// Estimated cycles, a line `CYCLES KERNEL` each.
        #[arg(long, value_name = "FILE")]
        estimates: Option<PathBuf>,
        /// Writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Touches an object, holds forces, releases it; checks the figures and draws pictures.
    Demo {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Draws the pictures into this folder.
        #[arg(long, value_name = "DIR", default_value = "target/demo")]
        out: PathBuf,
        /// Holds each force for a shorter time and leaves out the second run.
        #[arg(long)]
        quick: bool,
    },
    /// Keeps the board alive for any DYNAMIXEL client, behind a pseudo-terminal or a TCP port.
    Serve {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Makes a symbolic link of this name to the pseudo-terminal.
        #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
        pty: Option<PathBuf>,
        /// Takes a TCP port of this machine instead of a pseudo-terminal; 0 takes any that is free.
        #[arg(long, value_name = "PORT")]
        tcp: Option<u16>,
        /// Distance of the object from the fingertip at power-on, mm.
        #[arg(long, default_value_t = Setup::default().wall.distance_mm)]
        distance_mm: f64,
    },
    /// Runs a scene with the image.
    #[cfg(feature = "scenes")]
    Sim {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        #[command(flatten)]
        scene: sim::cli::Args,
    },
    /// Runs drawn fingers with the image.
    #[cfg(feature = "scenes")]
    Population {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        #[command(flatten)]
        population: sim::population::Args,
    },
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        #[cfg(feature = "log")]
        Command::Run { image, ms } => commands::run(&image, ms),
        #[cfg(feature = "bringup")]
        Command::Bringup { image, frames, estimates, json } => {
            commands::bringup(&image, frames, estimates.as_deref(), json.as_deref())
        }
        Command::Demo { image, json, out, quick } => commands::demo(image, json.as_deref(), &out, quick),
        Command::Serve { image, pty, tcp, distance_mm } => {
            let place = tcp.map_or_else(|| Place::Pty(pty), Place::Tcp);
            commands::serve(&image, &place, distance_mm)
        }
        #[cfg(feature = "scenes")]
        Command::Sim { image, scene } => {
            use sim::cli::{Board, answer};
            return answer(&scene, &|of, watch| match scene.board {
                Board::Native => sim::native::board(of, watch),
                Board::Virtual | Board::Both => simulate(&image, of, watch).map_err(Into::into),
            });
        }
        #[cfg(feature = "scenes")]
        Command::Population { image, population } => {
            use sim::population::{Board, answer};
            return answer(&population, &|of, watch| match population.board {
                Board::Native => sim::native::board(of, watch),
                Board::Calibrated => sim::native::calibrated::board(of, watch),
                Board::Virtual => simulate(&image, of, watch).map_err(Into::into),
            });
        }
    };
    let shown = output::say::end();
    match result {
        Ok(()) if shown => ExitCode::SUCCESS,
        Ok(()) => ExitCode::FAILURE,
        Err(error) => {
            output::say::aside(format_args!("virtual-board: {error}"));
            ExitCode::FAILURE
        }
    }
}
