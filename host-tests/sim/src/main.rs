//! `sim`: runs a scene on the native board.

use clap::Parser;
use sim::cli::{self, Args};
use sim::native;
use std::process::ExitCode;

fn main() -> ExitCode {
    cli::answer(&Args::parse(), &|scene, watch| native::simulate(scene, watch).map_err(Into::into))
}
