//! `sensor`: what recordings of a real sensor say of the parameters.

use clap::{Parser, Subcommand};
use output::{kept, say};
use sensor::gains::{self, Found};
use sensor::presses::Presses;
use sensor::table::Refusal;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Fits a sensor's characteristic and creep to recordings.
#[derive(Parser)]
#[command(
    name = "sensor",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  cargo xtask sensor fit cycles.csv --judge others.csv\n  cargo xtask sensor gains --help"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fits to one recording, chooses by cross-validation among the firmware's models, and judges on another recording
    ///
    /// The columns say what is fitted: set,sample,force_N,conductance_mS the characteristic of each set, force over
    /// conductance 1/R of the taxel; run,weight_kg,t_s,conductance_mS the creep under weights held still. Other columns
    /// may stand beside them. Readings at the converter's end and holds without a weight are left out, and told.
    #[command(after_help = "Examples:\n  \
        cargo xtask sensor fit cycles.csv --judge others.csv --json fit.json\n  \
        cargo xtask sensor fit holds.csv\n\n\
        Exits with 0, or with 2 where a file cannot be used: nothing is written then.")]
    Fit {
        /// The recording to fit to
        #[arg(value_name = "FIT.csv")]
        fit: PathBuf,
        /// The recording to judge on: sets of the same names, or any holds
        #[arg(long, value_name = "JUDGE.csv")]
        judge: Option<PathBuf>,
        /// Writes every figure, its unit in the key's name
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Fits the taxels' gains and the scale to presses under a load cell, each press left out in turn
    ///
    /// Columns: force_N, the force on the tip; r0c0, r0c1 and so on, the raw code of each taxel by row and column; and
    /// press, a name for each press, where it is known. Begin free of contact, which gives the tare; press slowly, at
    /// ten places or more, each wholly on the array. The characteristic has to be a line: curve_permille 0.
    #[command(after_help = "Examples:\n  \
        cargo xtask sensor gains presses.csv --judge others.csv --parameters array.toml\n  \
        fingertip params restore array.toml --save\n\n\
        Exits with 0, or with 2 where a file cannot be used: nothing is written then.")]
    Gains {
        /// The recording to fit to
        #[arg(value_name = "FIT.csv")]
        fit: PathBuf,
        /// The recording to judge on, of the same array
        #[arg(long, value_name = "JUDGE.csv")]
        judge: Option<PathBuf>,
        /// Writes every figure, its unit in the key's name
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Writes gains and scale, for `fingertip params restore`
        #[arg(long, value_name = "FILE")]
        parameters: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Fit { fit, judge, json } => sensor::fit(&fit, judge.as_deref()).and_then(|answer| {
            write(json.as_deref(), || as_json(&answer))?;
            say::text(&answer);
            Ok(())
        }),
        Command::Gains { fit, judge, json, parameters } => gains(&fit, judge.as_deref()).and_then(|found| {
            write(json.as_deref(), || as_json(&found))?;
            write(parameters.as_deref(), || found.parameters())?;
            say::text(&found);
            Ok(())
        }),
    };
    match done {
        Ok(()) if say::end() => ExitCode::SUCCESS,
        Ok(()) => ExitCode::from(2),
        Err(refusal) => {
            say::aside(format_args!("error: {refusal}"));
            ExitCode::from(2)
        }
    }
}

fn gains(fit: &Path, judge: Option<&Path>) -> Result<Found, Refusal> {
    let presses = Presses::read(fit)?;
    gains::fit(&presses, judge.map(Presses::read).transpose()?.as_ref())
}

fn as_json(answer: &impl Serialize) -> String {
    serde_json::to_string_pretty(answer).unwrap_or_default() + "\n"
}

/// Writes a file where one is asked for.
fn write(path: Option<&Path>, text: impl FnOnce() -> String) -> Result<(), Refusal> {
    let Some(path) = path else { return Ok(()) };
    kept::Lock::take(path).and_then(|lock| lock.write(text())).map_err(|error| {
        let why = "name a file in a folder that can be written";
        Refusal(format!("{} cannot be written ({error}): {why}", path.display()))
    })
}
