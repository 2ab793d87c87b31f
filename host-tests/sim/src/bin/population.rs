//! `population`: many drawn fingers on the native board.

use clap::Parser;
use sim::native;
use sim::population::cli::{self, Args, Board};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    if args.board != Board::Native {
        host_tests::say::aside(
            "this program is the native board: `cargo xtask population --board virtual` runs the flash image",
        );
        return ExitCode::from(2);
    }
    cli::answer(&args, &native::board)
}
