//! The demonstration on the native core: `demo [--quick] [--out DIR]`.
//!
//! The same script, plant and figures as on the flash image, without a microcontroller in between.

use host_tests::demo::{DemoError, Forces, Script, figures::missed, native, pictures, table};
use host_tests::say;
use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (mut script, mut out) = (Script::whole(), PathBuf::from("target/demo/native"));
    while let Some(argument) = arguments.next() {
        match (argument.to_str(), arguments.len()) {
            (Some("--quick"), _) => script = Script::quick(),
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
    let missed = run(&script, &out);
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

/// Plays, prints the table, draws the pictures; how many bounds are missed.
fn run(script: &Script, out: &std::path::Path) -> Result<usize, DemoError> {
    let run = native::play(script)?;
    let forces = Forces::of(&run)?;
    let checks = forces.checks();
    let drawn = pictures::draw(&run, &forces, out);
    say::text(table::table(&checks, &forces));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    Ok(missed(&checks))
}
