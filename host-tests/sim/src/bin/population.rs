//! `population`: many drawn fingers on the native board.

use clap::Parser;
use sim::native;
use sim::population::cli::{self, Args, Board};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    match args.board {
        Board::Native => cli::answer(&args, &native::board),
        Board::Virtual => {
            output::say::aside(
                "this program is the native board: `cargo xtask population --board virtual` runs the flash image",
            );
            ExitCode::from(2)
        }
    }
}
