//! `sim`: runs a scene on the native board.

use clap::Parser;
use sim::cli::{self, Args, Board};
use sim::native;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = Args::parse();
    if args.board != Board::Native && args.runs() {
        output::say::aside("this program is the native board: `cargo xtask sim --board ...` runs the flash image");
        return ExitCode::from(2);
    }
    cli::answer(&args, &native::board)
}
