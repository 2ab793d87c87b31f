//! `bringup-host`: takes the report of a board at a serial port and judges it.

use bringup::judge::{Board, estimates, judge};
use bringup::listen::listen;
use bringup::{BAUD, FRAMES};
use clap::Parser;
use serial2::SerialPort;
use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Silence after which the image counts as hung; each of its steps reports earlier.
const SILENT: Duration = Duration::from_secs(60);

/// Takes the report of a board at a serial port and judges it.
#[derive(Parser)]
struct Arguments {
    /// The ST-LINK's virtual COM port.
    #[arg(long, value_name = "PORT")]
    port: PathBuf,
    /// SHA-256 of the flashed image.
    #[arg(long, value_name = "SHA-256")]
    sha256: String,
    /// Number of frames for which the rows are read back.
    #[arg(long, default_value_t = FRAMES)]
    frames: u32,
    /// Estimated cycles, a line `CYCLES KERNEL` each.
    #[arg(long, value_name = "FILE")]
    estimates: Option<PathBuf>,
    /// Writes the figures to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// True if nothing fails.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let Arguments { port, sha256, frames, estimates: path, json } = arguments;
    let mut port = SerialPort::open(port, BAUD).map_err(|error| format!("{}: {error}", port.display()))?;
    port.set_read_timeout(SILENT)?;
    let report = listen(&mut port, *frames, &mut |said| println!("{said}"))?;
    let estimates = path.as_deref().map(estimates).transpose()?.unwrap_or_default();
    let judgement = judge(&report, Board::Silicon, sha256.clone(), &estimates);
    print!("{}", judgement.text());
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&judgement)? + "\n";
        fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(judgement.failed == 0)
}
