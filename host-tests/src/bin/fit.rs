//! Judges the fit of the contact on many pictures, and writes the tables of `docs/contact.md`.

use fingertip::contact::FitLevel;
use host_tests::fit_statistics::{CASES, PAGE, markdown};
use host_tests::program::{Progress, ended};
use std::process::ExitCode;

const USAGE: &str = "fit [--cases N] [--quick] [--fit-level N] [--write | --check]";

enum Page {
    Print,
    Write,
    Check,
}

fn main() -> ExitCode {
    ended(run())
}

fn run() -> Result<(), String> {
    let (mut cases, mut fit_level, mut page) = (CASES, FitLevel::default(), Page::Print);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--cases" => {
                let number = arguments.next().and_then(|number| number.parse().ok()).filter(|number| *number > 0);
                cases = number.ok_or("--cases takes a number above 0")?;
            }
            "--fit-level" => {
                let number = arguments.next().and_then(|number| number.parse::<usize>().ok());
                let found = number.and_then(|number| FitLevel::ALL.get(number));
                fit_level = *found.ok_or("--fit-level takes a number from 0 to 5")?;
            }
            "--quick" => cases = CASES / 20,
            "--write" => page = Page::Write,
            "--check" => page = Page::Check,
            other => return Err(format!("unknown argument {other}: {USAGE}")),
        }
    }
    let progress = Progress::begin();
    let tables = markdown(cases, fit_level, &|name, done| {
        progress.show(format_args!("{name}: {done} of {cases}          "));
    });
    progress.end(format_args!("\r{:60}\r", ""));
    match page {
        Page::Print => print!("{tables}"),
        Page::Write => PAGE.write(&tables)?,
        Page::Check => PAGE.check(&tables)?,
    }
    Ok(())
}
