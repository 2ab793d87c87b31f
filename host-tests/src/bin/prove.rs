//! Proves the model's error bounds over whole input ranges; `--quick` takes a thousandth of the inputs.
//!
//! Prints, for each function, how many inputs were judged and the worst case; fails where a bound does not hold.
//! `--write` puts these figures into `docs/model.md`, `--check` fails where they are stale there.

use clap::Parser;
use std::process::ExitCode;
use std::time::Instant;

use host_tests::program::{Progress, ended};
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
    let mut report = Report { started: Instant::now(), inputs: 0, broken: 0, sections: Vec::new() };
    let tip = reference_tip();
    let reach = |bits: i32| bits as u64 / share + 1;

    report.section("Every input of the reference tip, a = 10 mm and Y = 250 kPa, judged by integers", |progress| {
        let mut all = exact::depths(&tip, 1..reach(tip.depth_max().to_bits()), progress).to_vec();
        all.extend(exact::forces(&tip, 0..reach(tip.force_max().to_bits()), progress));
        all.extend(exact::radii(&tip, 0..reach(tip.contact_radius(tip.depth_max()).to_bits()), progress));
        all.extend(exact::peaks(&tip, 0..reach(tip.peak_pressure(tip.depth_max()).to_bits()), progress));
        all
    });
    report.section("A grid of the reference tip, pressures by integers", |progress| {
        let mut all = exact::pressures(&tip, 4_000 / share, 2_500, progress).to_vec();
        all.extend(random::touching_angles(&tip, 1_000_000 / share, progress));
        all
    });
    report.section("Boundaries and random points of the whole domain, also by integers", |progress| {
        let mut all = random::boundaries(progress);
        let points = random::points(0..10_000_000 / share, progress);
        all.iter_mut().zip(&points).for_each(|(all, points)| all.merge(points));
        all.to_vec()
    });
    report.section("The rest of the model at random points", |progress| {
        let points = 0..200_000 / share;
        let mut all = reference::geometry(points.clone(), progress).to_vec();
        all.extend(reference::tilt(points.clone(), progress));
        all.extend(reference::friction(points, progress));
        all.extend(reference::relaxation(0..1_000_000 / share / 1_000, progress));
        all
    });
    println!("the relaxation filter over and over, terms of 1 to {} periods", paper::PERIODS_MAX / share as u32);
    for (name, pattern) in [("constant extreme", [i32::MAX; 2]), ("alternating extremes", [i32::MAX, 0])] {
        let reference::LongRun { steps, low, high } = reference::long_run(&pattern, paper::PERIODS_MAX / share as u32);
        println!("  {name}: repeats itself from step {steps} on, between {low} and {high} N");
    }
    match reference::check() {
        Ok(tallies) => {
            report.judged("The points of `host-tests/oracle/park2003.csv`", |_| tallies.to_vec());
        }
        Err(error) => {
            eprintln!("{}: {error}", reference::path().display());
            report.broken += 1;
        }
    }
    report.end((write || check).then_some(check))
}

struct Report {
    started: Instant,
    inputs: u64,
    broken: u64,
    sections: Vec<(String, Vec<Tally>)>,
}

impl Report {
    /// Judges functions for the tables of `docs/model.md`.
    fn section(&mut self, title: &str, judge: impl FnOnce(exact::Progress<'_>) -> Vec<Tally>) {
        let tallies = self.judged(title, judge);
        self.sections.push((title.to_owned(), tallies));
    }

    /// Judges functions and prints how they did.
    fn judged(&mut self, title: &str, judge: impl FnOnce(exact::Progress<'_>) -> Vec<Tally>) -> Vec<Tally> {
        println!("{title}");
        let progress = Progress::begin();
        let tallies = judge(&|done, of| progress.show(format_args!("  {done} of {of}   ")));
        progress.end("\r");
        for tally in &tallies {
            println!("  {tally}");
            self.inputs += tally.inputs;
            self.broken += u64::from(!tally.holds());
        }
        tallies
    }

    /// Ends the program; writes or checks the tables of `docs/model.md` if wanted.
    fn end(&self, check: Option<bool>) -> ExitCode {
        let seconds = self.started.elapsed().as_secs();
        println!("{} results judged in {seconds} s; {} bounds broken", self.inputs, self.broken);
        if self.broken > 0 {
            return ExitCode::FAILURE;
        }
        ended(check.map_or(Ok(()), |check| tally::PAGE.renew(&tally::markdown(&self.sections), check)))
    }
}
