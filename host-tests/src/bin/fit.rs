//! Judges the fit of the contact on many pictures, and writes the tables of `docs/contact.md`.

use fingertip::contact::FitLevel;
use host_tests::fit_tables::{CASES, PAGE, markdown};
use std::io::{self, IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const USAGE: &str = "fit [--cases N] [--quick] [--fit-level N] [--write | --check]";

enum Page {
    Print,
    Write,
    Check,
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
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
    // A log wants the results only.
    let live = io::stderr().is_terminal();
    let shown = Mutex::new(Instant::now());
    let tables = markdown(cases, fit_level, &|name, done| {
        if live
            && let Ok(mut shown) = shown.try_lock()
            && shown.elapsed() > Duration::from_millis(500)
        {
            *shown = Instant::now();
            eprint!("\r{name}: {done} of {cases}          ");
            // Progress is a courtesy; a closed terminal is no reason to stop.
            let _ = io::stderr().flush();
        }
    });
    if live {
        eprint!("\r{:60}\r", "");
    }
    match page {
        Page::Print => print!("{tables}"),
        Page::Write => PAGE.write(&tables)?,
        Page::Check => PAGE.check(&tables)?,
    }
    Ok(())
}
