//! `budget`: causes of the error of the force, by fingers without one cause at a time.

use clap::Parser;
use output::say;
use sim::cli::verdict;
use sim::native;
use sim::population::budget::{self, Budget};
use std::process::ExitCode;

/// Says how much of the force's error each of the sensor's weaknesses makes at 0.5, 1, 2 and 5 N.
#[derive(Debug, Parser)]
#[command(name = "budget", version, after_help = "Examples:\n  budget --fingers 300")]
struct Args {
    /// Number of fingers, each run 14 times, for the whole loop 17 times
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(1..))]
    fingers: u32,
    /// Prints instead, as JSON for the study, the errors of the force at each fit level and at other frame rates
    #[arg(long)]
    whole_loop: bool,
}

fn main() -> ExitCode {
    let Args { fingers, whole_loop: whole } = Args::parse();
    let answer = match whole {
        true => budget::whole_loop(fingers as usize),
        false => Budget::of(fingers as usize, &native::board, &native::calibrated::board).map(|budget| budget.page()),
    };
    verdict(answer.map(|text| {
        say::text(text);
        true
    }))
}
