//! The command line of `population`, the same for both boards.

use super::run;
use super::text::text;
use super::{Report, load, worst};
use crate::cli::verdict;
use crate::run::{Run, RunError};
use crate::sweep::Shard;
use clap::{Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Draws fingers as a usual build brings them about, runs each, and says how many keep within the envelope.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "population",
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  \
        population ordinary --fingers 1000 --seed 1 --json ordinary.json\n  \
        population ordinary --fingers 100 --worst 5 --out worst    (then: sim worst/ordinary-1-17.toml)\n  \
        population ordinary --fingers 1000 --shard 2/4 --json 2.json    (on the second of four machines)\n  \
        population merge 1.json 2.json 3.json 4.json --json all.json    (the same, byte for byte, as without --shard)"
)]
pub struct Args {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// The population: a file, or one of those that come with the project: careful, ordinary, rough
    #[arg(required = true)]
    population: Option<String>,
    /// How many fingers the whole has
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    fingers: u32,
    /// Of the draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Runs only the I-th of N shares of the fingers, for `merge`
    #[arg(long, value_name = "I/N", requires = "json")]
    shard: Option<Shard>,
    /// What runs the controller: the same core on the host, or the flash image on the emulated microcontroller
    #[arg(long, value_enum, default_value_t = Board::Native)]
    pub board: Board,
    /// Writes every finger's draws, promises and metrics for scripts
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes the scenes of the N worst fingers
    #[arg(long, value_name = "N", requires = "out")]
    worst: Option<usize>,
    /// Where the scenes of the worst fingers go
    #[arg(long, value_name = "DIR", requires = "worst")]
    out: Option<PathBuf>,
}

/// What runs the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The same core on the host.
    Native,
    /// The flash image on the emulated microcontroller.
    Virtual,
}

#[derive(Clone, Debug, Subcommand)]
enum Merge {
    /// Puts the shards of a population together
    Merge {
        /// The shards' files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Where the whole goes
        #[arg(long, value_name = "FILE")]
        json: PathBuf,
    },
}

/// Does what is asked for. Exit code 0: every finger kept within the envelope; 1: one did not; 2: it could not be done.
pub fn answer(args: &Args, board: Run) -> ExitCode {
    verdict(match &args.merge {
        Some(Merge::Merge { files, json }) => Report::merge(files).and_then(|report| {
            print!("{}", text(&report));
            report.write(json)?;
            Ok(report.inside() == report.fingers.len())
        }),
        None => population(args, board),
    })
}

fn population(args: &Args, board: Run) -> Result<bool, RunError> {
    let started = Instant::now();
    let population = load(args.population.as_deref().unwrap_or_default())?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let board_name = match args.board {
        Board::Native => "native",
        Board::Virtual => "virtual",
    };
    let fingers = run::fingers(&population, args.seed, args.fingers as usize, shard, board)?;
    let report = Report::new(&population, board_name, args.seed, args.fingers as usize, fingers);
    print!("{}", text(&report));
    if let Some(path) = &args.json {
        report.write(path)?;
    }
    if let (Some(count), Some(out)) = (args.worst, &args.out) {
        for path in worst::write(&population, &report, count, out)? {
            println!("wrote {}", path.display());
        }
    }
    println!("{} fingers in {:.1} s", report.fingers.len(), started.elapsed().as_secs_f64());
    Ok(report.inside() == report.fingers.len())
}
