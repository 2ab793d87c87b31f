//! Command line of `population`, the same for both boards.

use super::report::{self, Ran, Report, judged, text};
use super::{go_on, load, write_worst};
use crate::cli::verdict;
use crate::part::Part;
use crate::run::{Run, RunError};
use crate::sweep::Shard;
use clap::{Parser, Subcommand, ValueEnum};
use output::say;
use std::fs;
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
        population ordinary --fingers 100 --worst 5 --out worst    (then: sim with a file it wrote)\n  \
        population ordinary --fingers 300 --board calibrated\n  \
        population unlike --fingers 40    (the error of the force before and after calibration)\n  \
        population ordinary --fingers 1000 --shard 2/4 --json 2.json    (on the second of four machines)\n  \
        population merge 1.json 2.json 3.json 4.json --json all.json    (the same, byte for byte, as without --shard)"
)]
pub struct Args {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// The population: a file, or one of those that come with the project: careful, handled, ordinary, rough,
    /// unlike
    #[arg(required = true)]
    population: Option<String>,
    /// Number of fingers in the whole population
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub fingers: u32,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Runs only the I-th of N shares of the fingers, for `merge`
    #[arg(long, value_name = "I/N", requires = "json")]
    shard: Option<Shard>,
    /// Platform of the controller: the same core on the host, or the flash image on the emulated microcontroller
    #[arg(long, value_enum, default_value_t = Board::Native)]
    pub board: Board,
    /// Writes every finger's draws, promises and metrics for scripts
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes the scenes of the N worst fingers: those that broke a promise, then those nearest to a bound
    #[arg(long, value_name = "N", requires = "out")]
    worst: Option<usize>,
    /// Folder for the scenes of the worst fingers
    #[arg(long, value_name = "DIR", requires = "worst")]
    out: Option<PathBuf>,
}

impl Args {
    /// Returns the name of the population as it was given.
    pub fn name(&self) -> Option<&str> {
        self.population.as_deref()
    }
}

/// Board that runs the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The same core on the host.
    Native,
    /// The core on the host, with a finger that the host calibrates first: three presses onto a plate, three holds on a
    /// kitchen scale.
    Calibrated,
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
        /// File for the merged results
        #[arg(long, value_name = "FILE")]
        json: PathBuf,
    },
}

/// Carries out the arguments. Exit code 0: every finger kept within the envelope; 1: one did not; 2: not done.
pub fn answer(args: &Args, board: Run) -> ExitCode {
    verdict(match &args.merge {
        Some(Merge::Merge { files, json }) => Report::merge(files).and_then(|report| {
            report.write(json)?;
            say::text(text(&report));
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
        Board::Calibrated => "calibrated",
        Board::Virtual => "virtual",
    };
    let all = args.fingers as usize;
    let numbers = (0..all).filter(|number| shard.has(*number));
    // For a regular file the progress is kept in a file next to it. Terminals and pipes get everything at the end.
    let into_file = |path: &&PathBuf| fs::metadata(path).is_ok_and(|known| known.is_file()) || !path.exists();
    let mut part = None;
    let mut done = Vec::new();
    if let Some(path) = args.json.as_ref().filter(into_file) {
        let id = report::id(&population, board_name, args.seed, all);
        let (opened, lines) = Part::open(path, &format!("the population {id}, fingers {shard}"))?;
        done = lines.iter().map(|line| serde_json::from_str(line)).collect::<Result<Vec<Ran>, _>>()?;
        if !done.is_empty() {
            say::aside(format_args!("goes on behind {} fingers that are done", done.len()));
        }
        part = Some(opened);
    }
    let keep = |ran: &Ran| part.as_mut().map_or(Ok(()), |part| part.add(&serde_json::to_string(ran)?));
    let fingers = go_on(&population, args.seed, numbers, done, board, keep)?;
    let report = Report::new(&population, board_name, args.seed, all, fingers);
    match (part, &args.json) {
        (Some(part), _) => {
            part.write(report.json()?)?;
            part.done()?;
        }
        (None, Some(path)) => report.write(path)?,
        (None, None) => {}
    }
    say::text(text(&report));
    if let (Some(count), Some(out)) = (args.worst, &args.out) {
        for (path, ran) in write_worst(&population, &report, count, out)?.iter().zip(report.worst()) {
            say::line(format_args!("wrote {}: {}", path.display(), judged(ran)));
        }
    }
    let (count, s) = (report.fingers.len(), started.elapsed().as_secs_f64());
    say::line(format_args!("{count} fingers in {s:.1} s"));
    Ok(report.inside() == report.fingers.len())
}
