//! `sweep`: many runs of a scene on the native board, over keys, seeds, cores and machines.

use clap::{Parser, Subcommand};
use output::say;
use sim::cli::verdict;
use sim::native;
use sim::sweep::{Plan, Shard, Vary, merge, sweep};
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;
use std::time::Instant;

/// Runs a scene many times: over values of its keys and over seeds, on all cores. Writes runs.csv, summary.csv and
/// plots.
#[derive(Parser)]
#[command(
    name = "sweep",
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  \
        sweep raspberry --seeds 1000\n  \
        sweep wall --vary tip.modulus_kpa=200..300:5 --vary tip.radius_mm=8..12:3\n  \
        sweep raspberry --seeds 1000 --shard 2/4 --out DIR    (on the second of four machines)\n  \
        sweep merge DIR/runs-*-of-4.csv --out DIR    (the same, byte for byte, as without --shard)"
)]
struct Args {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// The scene: a file, or a name out of the library
    #[arg(required = true)]
    scene: Option<String>,
    /// Varies a key over N values (5 where N is not given); may be given many times: all combinations are run
    #[arg(long, value_name = "TABLE.KEY=LO..HI[:N]", value_parser = Vary::from_str)]
    vary: Vec<Vary>,
    /// Replaces a value of the scene, in every run
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    set: Vec<String>,
    /// Seeds at each point, counted on from the scene's
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
    /// Runs only the I-th of N shares, for merging
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Folder for the results; by default a folder in target/sweep that is named after the sweep
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Merge {
    /// Puts the shards of a sweep together
    Merge {
        /// The shards' files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Folder for the results
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
}

fn main() -> ExitCode {
    let Args { merge: merged, scene, vary, set, seeds, shard, out } = Args::parse();
    let started = Instant::now();
    let (done, whole) = match merged {
        Some(Merge::Merge { files, out }) => (merge(&files, &out).map(|table| (table, out)), true),
        None => {
            let plan =
                Plan { scene: scene.unwrap_or_default(), set, vary, seeds, shard: shard.unwrap_or(Shard::WHOLE), out };
            (sweep(&plan, &native::board), plan.shard.is_whole())
        }
    };
    verdict(done.map(|(table, out)| {
        if whole {
            say::text(table.text());
        }
        let (runs, s, out) = (table.rows.len(), started.elapsed().as_secs_f64(), out.display());
        say::line(format_args!("{runs} runs in {s:.1} s, written to {out}"));
        table.passed()
    }))
}
