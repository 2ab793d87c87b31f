//! Judges the fit of the contact on many pictures, and writes the tables of `docs/contact.md`.

use clap::Parser;
use fingertip::contact::FitLevel;
use host_tests::fit_statistics::{CASES, PAGE, markdown};
use host_tests::program::ended;
use indicatif::ProgressBar;
use std::process::ExitCode;

/// Judges the contact's fit on thousands of pictures.
#[derive(Parser)]
#[command(name = "fit", after_help = "Examples:\n  fit --quick\n  fit --check\n  fit --write")]
struct Args {
    /// Cases a series
    #[arg(long, value_name = "N", default_value_t = CASES as u32, value_parser = clap::value_parser!(u32).range(1..))]
    cases: u32,
    /// Take a twentieth of the cases
    #[arg(long, conflicts_with = "cases")]
    quick: bool,
    /// The loop's fit level
    #[arg(long, value_name = "0 TO 5", value_parser = fit_level)]
    fit_level: Option<FitLevel>,
    /// Write the tables into docs/contact.md instead of printing them
    #[arg(long, conflicts_with_all = ["quick", "cases"])]
    write: bool,
    /// Fail where the tables in docs/contact.md are stale
    #[arg(long, conflicts_with_all = ["quick", "cases", "write"])]
    check: bool,
}

fn fit_level(word: &str) -> Result<FitLevel, String> {
    let level = word.parse().ok().and_then(|number: usize| FitLevel::ALL.get(number).copied());
    level.ok_or_else(|| "takes a number from 0 to 5".into())
}

fn main() -> ExitCode {
    ended(run(&Args::parse()))
}

fn run(args: &Args) -> Result<(), String> {
    let cases = if args.quick { CASES / 20 } else { args.cases as usize };
    let progress = ProgressBar::new_spinner();
    let tables = markdown(cases, args.fit_level.unwrap_or_default(), &|name, done| {
        progress.set_message(format!("{name}: {done} of {cases}"));
    });
    progress.finish_and_clear();
    if args.write || args.check {
        return PAGE.renew(&tables, args.check);
    }
    print!("{tables}");
    Ok(())
}
