//! Proves the model's error bounds over whole input ranges; `--quick` takes a thousandth of the inputs.
//!
//! Prints, for each function, how many inputs were judged and the worst case; fails where a bound does not hold.
//! `--write` puts these figures into `docs/model.md`, `--check` fails where they are stale there.

use clap::Parser;
use indicatif::ProgressBar;
use std::process::ExitCode;
use std::time::Instant;

use host_tests::program::ended;
use host_tests::prove::random::{self, reference_tip};
use host_tests::prove::tally::{self, Tally};
use host_tests::prove::{exact, reference};

/// Proves the contact model's error bounds over whole input ranges.
#[derive(Parser)]
#[command(name = "prove", after_help = "Examples:\n  prove --quick\n  prove --check")]
struct Args {
    /// Take a thousandth of the inputs
    #[arg(long)]
    quick: bool,
    /// Write the figures into docs/model.md
    #[arg(long, conflicts_with = "quick")]
    write: bool,
    /// Fail where the figures in docs/model.md are stale
    #[arg(long, conflicts_with_all = ["quick", "write"])]
    check: bool,
}

fn main() -> ExitCode {
    let Args { quick, write, check } = Args::parse();
    let share = if quick { 1_000 } else { 1 };
    let started = Instant::now();
    let tip = reference_tip();
    let reach = |bits: i32| bits as u64 / share + 1;

    let inputs =
        judged("Every input of the reference tip, a = 10 mm and Y = 250 kPa, judged by integers", |progress| {
            let mut all = exact::depths(&tip, 1..reach(tip.depth_max().to_bits()), progress).to_vec();
            all.extend(exact::forces(&tip, 0..reach(tip.force_max().to_bits()), progress));
            all.extend(exact::radii(&tip, 0..reach(tip.contact_radius(tip.depth_max()).to_bits()), progress));
            all.extend(exact::peaks(&tip, 0..reach(tip.peak_pressure(tip.depth_max()).to_bits()), progress));
            all
        });
    let grid = judged("A grid of the reference tip, pressures by integers", |progress| {
        exact::pressures(&tip, 4_000 / share, 2_500, progress).to_vec()
    });
    let points = judged("Boundaries and random points of the whole domain, also by integers", |progress| {
        let mut all = random::boundaries(progress);
        let points = random::points(0..10_000_000 / share, progress);
        all.iter_mut().zip(&points).for_each(|(all, points)| all.merge(points));
        all.to_vec()
    });
    let rest = judged("The rest of the model at random points", |progress| {
        reference::columns(0..200_000 / share, progress).to_vec()
    });
    let sections = [inputs, grid, points, rest];
    let (oracle, unread) = match reference::check() {
        Ok(tallies) => (judged("The points of `host-tests/oracle/park2003.csv`", |_| tallies.to_vec()).1, 0),
        Err(error) => {
            eprintln!("{}: {error}", reference::path().display());
            (Vec::new(), 1)
        }
    };
    let all = || sections.iter().flat_map(|(_, tallies)| tallies).chain(&oracle);
    let judged: u64 = all().map(|tally| tally.inputs).sum();
    let broken = all().filter(|tally| !tally.holds()).count() + unread;
    println!("{judged} results judged in {} s; {broken} bounds broken", started.elapsed().as_secs());
    if broken > 0 {
        return ExitCode::FAILURE;
    }
    ended(if write || check { tally::PAGE.renew(&tally::markdown(&sections), check) } else { Ok(()) })
}

/// Judges functions and prints how they did; the section's title and its tallies.
fn judged(title: &str, judge: impl FnOnce(exact::Progress<'_>) -> Vec<Tally>) -> (String, Vec<Tally>) {
    println!("{title}");
    let progress = ProgressBar::new_spinner();
    let tallies = judge(&|done, of| progress.set_message(format!("{done} of {of}")));
    progress.finish_and_clear();
    tallies.iter().for_each(|tally| println!("  {tally}"));
    (title.to_owned(), tallies)
}
