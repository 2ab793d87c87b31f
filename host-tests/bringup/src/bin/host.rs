//! `bringup-host`: takes the report of a board at a serial port and judges it.

use bringup::BAUD;
use bringup::judge::{Board, Options};
use clap::Parser;
use output::say;
use serial2::SerialPort;
use std::io::Error;
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
    #[command(flatten)]
    options: Options,
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(0) if say::end() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            say::aside(format_args!("error: {error}"));
            ExitCode::from(2)
        }
    }
}

/// Returns the number of failed checks.
fn run(Arguments { port, sha256, options }: Arguments) -> Result<usize, Error> {
    let named = |error: Error| Error::new(error.kind(), format!("{}: {error}", port.display()));
    let mut port = SerialPort::open(&port, BAUD).map_err(named)?;
    port.set_read_timeout(SILENT)?;
    Ok(options.judge(&mut port, Board::Silicon, sha256)?.failed)
}
