//! `virtual-board`: the flash image on the emulated board.

mod commands;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

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
    Run(commands::run::Arguments),
    /// Runs the image of `cargo xtask bringup` and judges its report.
    #[cfg(feature = "bringup")]
    Bringup(commands::bringup::Arguments),
    /// Touches an object, holds forces, releases it; checks the figures and draws pictures.
    Demo(commands::demo::Arguments),
    /// Keeps the board alive for any DYNAMIXEL client, behind a pseudo-terminal or a TCP port.
    Serve(commands::serve::Arguments),
    /// Runs a scene with the image.
    #[cfg(feature = "scenes")]
    Sim(commands::sim::Arguments),
    /// Runs drawn fingers with the image.
    #[cfg(feature = "scenes")]
    Population(commands::population::Arguments),
}

fn main() -> ExitCode {
    let result: Result<(), Box<dyn std::error::Error>> = match Arguments::parse().command {
        #[cfg(feature = "log")]
        Command::Run(arguments) => commands::run::run(&arguments).map_err(Into::into),
        #[cfg(feature = "bringup")]
        Command::Bringup(arguments) => commands::bringup::run(&arguments).map_err(Into::into),
        Command::Demo(arguments) => commands::demo::run(&arguments).map_err(Into::into),
        Command::Serve(arguments) => commands::serve::run(&arguments).map_err(Into::into),
        #[cfg(feature = "scenes")]
        Command::Sim(arguments) => return commands::sim::run(&arguments),
        #[cfg(feature = "scenes")]
        Command::Population(arguments) => return commands::population::run(&arguments),
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
