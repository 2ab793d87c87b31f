//! `population`: many drawn fingers on the native board.

use clap::Parser;
use output::say;
use sim::cli::verdict;
use sim::native::{self, calibrated};
use sim::population::{self, Args, Board};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    match args.board {
        // Shows the error of the force before and after calibration.
        Board::Native if args.population.as_deref() == Some("unlike") => {
            verdict(calibrated::fingers(args.seed, args.fingers as usize).map(|fingers| {
                say::text(calibrated::errors_text(&fingers));
                true
            }))
        }
        Board::Native => population::answer(&args, &native::board),
        Board::Calibrated => population::answer(&args, &native::calibrated::board),
        Board::Virtual => {
            say::aside(
                "this program is the native board: `cargo xtask population --board virtual` runs the flash image",
            );
            ExitCode::from(2)
        }
    }
}
