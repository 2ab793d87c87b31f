//! `sensor`: what recordings of a real sensor say of the parameters.

use clap::{Parser, Subcommand};
use host_tests::{kept, say};
use std::path::PathBuf;
use std::process::ExitCode;

/// Fits a sensor's characteristic and creep to recordings.
#[derive(Parser)]
#[command(name = "sensor", version, arg_required_else_help = true)]
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
}

fn main() -> ExitCode {
    let Command::Fit { fit, judge, json } = Cli::parse().command;
    let answer = match sensor::fit(&fit, judge.as_deref()) {
        Ok(answer) => answer,
        Err(refusal) => {
            say::aside(format_args!("error: {refusal}"));
            return ExitCode::from(2);
        }
    };
    if let Some(json) = json {
        let text = serde_json::to_string_pretty(&answer).unwrap_or_default() + "\n";
        if let Err(error) = kept::Lock::take(&json).and_then(|lock| lock.write(text)) {
            let why = "name a file in a folder that can be written";
            say::aside(format_args!("error: {} cannot be written ({error}): {why}", json.display()));
            return ExitCode::from(2);
        }
    }
    say::text(&answer);
    if say::end() { ExitCode::SUCCESS } else { ExitCode::from(2) }
}
