//! `sim`: runs a scene on the native board.

use clap::Parser;
use sim::cli::{self, Args};
use std::process::ExitCode;

fn main() -> ExitCode {
    cli::answer(&Args::parse())
}
