//! Judges the fit of the contact on many pictures, and writes the tables of `docs/contact.md`.

use clap::Parser;
use host_tests::fit_statistics::{CASES, PAGE, markdown};
use host_tests::program::ended;
use indicatif::ProgressBar;
use std::process::ExitCode;

/// Judges the contact's fit on thousands of pictures.
#[derive(Parser)]
#[command(name = "fit", after_help = "Examples:\n  fit --quick\n  fit --check\n  fit --write")]
struct Args {
    /// Take a twentieth of the cases
    #[arg(long)]
    quick: bool,
    /// Write the tables into docs/contact.md instead of printing them
    #[arg(long, conflicts_with = "quick")]
    write: bool,
    /// Fail where the tables in docs/contact.md are stale
    #[arg(long, conflicts_with_all = ["quick", "write"])]
    check: bool,
}

fn main() -> ExitCode {
    ended(run(&Args::parse()))
}

fn run(args: &Args) -> Result<(), String> {
    let cases = if args.quick { CASES / 20 } else { CASES };
    let progress = ProgressBar::new_spinner();
    let tables = markdown(cases, &|name, done| {
        progress.set_message(format!("{name}: {done} of {cases}"));
    });
    progress.finish_and_clear();
    if args.write || args.check {
        return PAGE.renew(&tables, args.check);
    }
    print!("{tables}");
    Ok(())
}
