//! Demonstration on the native board: `demo [--quick] [--out DIR]`.
//!
//! It has the same scene and figures as on the flash image, without a microcontroller.

use clap::Parser;
use output::say;
use sim::demo::{self, Forces, Trace, draw, missed, table};
use sim::run::RunError;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Runs the demonstration's scene on the native board.
#[derive(Parser)]
#[command(name = "demo", version)]
struct Args {
    /// Holds each force for a shorter time
    #[arg(long)]
    quick: bool,
    /// Folder for the pictures
    #[arg(long, value_name = "DIR", default_value = "target/demo/native")]
    out: PathBuf,
}

fn main() -> ExitCode {
    let Args { quick, out } = Args::parse();
    match run(quick, &out) {
        Ok(0) if say::end() => return ExitCode::SUCCESS,
        Ok(0) => {}
        Ok(missed) => say::aside(format_args!("demo: {missed} of the bounds missed; see the table")),
        Err(error) => say::aside(format_args!("demo: {error}")),
    }
    ExitCode::FAILURE
}

/// Runs the scene, prints the table, draws the pictures; how many bounds are missed.
fn run(quick: bool, out: &Path) -> Result<usize, RunError> {
    let scene = demo::scene(quick)?;
    let mut trace = Trace::new(&scene);
    sim::simulate(&scene, &mut trace)?;
    let run = trace.finish()?;
    let forces = Forces::of(&run)?;
    let checks = forces.checks();
    let drawn = draw(&run, &forces, out);
    say::text(table(&checks));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    Ok(missed(&checks))
}
