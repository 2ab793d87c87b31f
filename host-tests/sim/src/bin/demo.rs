//! Demonstration on the native board: `demo [--quick] [--out DIR]`.
//!
//! It has the same scene and figures as on the flash image, without a microcontroller.

use output::say;
use sim::demo::figures::{draw, missed, table};
use sim::demo::{self, DemoError, Forces, Trace};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (mut quick, mut out) = (false, PathBuf::from("target/demo/native"));
    while let Some(argument) = arguments.next() {
        match (argument.to_str(), arguments.len()) {
            (Some("--quick"), _) => quick = true,
            (Some("--out"), 1..) => out = arguments.next().unwrap_or_default().into(),
            _ => {
                say::aside(format_args!(
                    "demo: {} is not understood; usage: demo [--quick] [--out DIR]",
                    argument.display()
                ));
                return ExitCode::from(2);
            }
        }
    }
    let missed = run(quick, &out);
    let shown = say::end();
    match missed {
        Ok(0) if shown => ExitCode::SUCCESS,
        Ok(0) => ExitCode::FAILURE,
        Ok(missed) => {
            say::aside(format_args!("demo: {missed} of the bounds missed; see the table"));
            ExitCode::FAILURE
        }
        Err(error) => {
            say::aside(format_args!("demo: {error}"));
            ExitCode::FAILURE
        }
    }
}

/// Runs the scene, prints the table, draws the pictures; how many bounds are missed.
fn run(quick: bool, out: &Path) -> Result<usize, DemoError> {
    let scene = demo::scene(quick)?;
    let mut trace = Trace::new(&scene);
    sim::simulate(&scene, &mut trace)?;
    let run = trace.finish()?;
    let forces = Forces::of(&run)?;
    let checks = forces.checks();
    let drawn = draw(&run, &forces, out);
    say::text(table(&checks, &forces));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    Ok(missed(&checks))
}
