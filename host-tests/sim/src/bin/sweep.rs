//! `sweep`: many runs of a scene on the native board, over keys, seeds, cores and machines.

use clap::{Parser, Subcommand};
use output::say;
use sim::cli::verdict;
use sim::native;
use sim::sweep::{Plan, merge, sweep};
use std::path::PathBuf;
use std::process::ExitCode;
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
    #[command(flatten)]
    plan: Option<Plan>,
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
    let Args { merge: merged, plan } = Args::parse();
    let started = Instant::now();
    let whole = plan.as_ref().is_none_or(|plan| plan.shard.is_whole());
    let done = match (merged, plan) {
        (Some(Merge::Merge { files, out }), _) => merge(&files, &out).map(|table| (table, out)),
        (None, Some(plan)) => sweep(&plan, &native::board),
        (None, None) => Err("a sweep needs a scene".into()),
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
