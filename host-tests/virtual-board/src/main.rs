//! `virtual-board`: the flash image on the emulated board.

use clap::{Parser, Subcommand};
use output::{kept, say};
use serve::{Place, Port};
use sim::demo::{draw, missed, table};
use sim::plant::{Plant, Setup};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use virtual_board::demo;
#[cfg(feature = "scenes")]
use virtual_board::scene::simulate;
use virtual_board::serve::Board;
use virtual_board::{Error, Options, Rig};

/// Runs the flash image on an emulated STM32 with the simulated fingertip around it.
#[derive(Debug, Parser)]
#[command(name = "virtual-board", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs the image of `cargo xtask bringup` and judges its report.
    #[cfg(feature = "bringup")]
    Bringup {
        /// The image, an ELF.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Number of frames for which the rows are read back.
        #[arg(long, default_value_t = 1_000)]
        frames: u32,
        /// Estimated cycles, a line `CYCLES KERNEL` each.
        #[arg(long, value_name = "FILE")]
        estimates: Option<PathBuf>,
        /// Writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Touches an object, holds forces, releases it; checks the figures and draws pictures.
    Demo {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Writes the figures to this file.
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Draws the pictures into this folder.
        #[arg(long, value_name = "DIR", default_value = "target/demo")]
        out: PathBuf,
        /// Holds each force for a shorter time and leaves out the second run.
        #[arg(long)]
        quick: bool,
    },
    /// Keeps the board alive for any DYNAMIXEL client, behind a pseudo-terminal or a TCP port.
    Serve {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        /// Makes a symbolic link of this name to the pseudo-terminal.
        #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
        pty: Option<PathBuf>,
        /// Takes a TCP port of this machine instead of a pseudo-terminal; 0 takes any that is free.
        #[arg(long, value_name = "PORT")]
        tcp: Option<u16>,
        /// Distance of the object from the fingertip at power-on, mm.
        #[arg(long, default_value_t = Setup::default().wall.distance_mm)]
        distance_mm: f64,
    },
    /// Runs a scene with the image.
    #[cfg(feature = "scenes")]
    Sim {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        #[command(flatten)]
        scene: sim::cli::Args,
    },
    /// Runs drawn fingers with the image.
    #[cfg(feature = "scenes")]
    Population {
        /// The flash image, an ELF for the STM32F446RE.
        #[arg(long, value_name = "ELF")]
        image: PathBuf,
        #[command(flatten)]
        population: sim::population::Args,
    },
}

fn main() -> ExitCode {
    let result = match Arguments::parse().command {
        #[cfg(feature = "bringup")]
        Command::Bringup { image, frames, estimates, json } => {
            bringup(&image, frames, estimates.as_deref(), json.as_deref())
        }
        Command::Demo { image, json, out, quick } => demo(&image, json.as_deref(), &out, quick),
        Command::Serve { image, pty, tcp, distance_mm } => {
            let place = tcp.map_or_else(|| Place::Pty(pty), Place::Tcp);
            serve(&image, &place, distance_mm)
        }
        #[cfg(feature = "scenes")]
        Command::Sim { image, scene } => {
            use sim::cli::{Board, answer};
            return answer(&scene, &|of, watch| match scene.board {
                Board::Native => sim::native::board(of, watch),
                Board::Virtual | Board::Both => simulate(&image, of, watch).map_err(Into::into),
            });
        }
        #[cfg(feature = "scenes")]
        Command::Population { image, population } => {
            use sim::population::{Board, answer};
            return answer(&population, &|of, watch| match population.board {
                Board::Native => sim::native::board(of, watch),
                Board::Calibrated => sim::native::calibrated::board(of, watch),
                Board::Virtual => simulate(&image, of, watch).map_err(Into::into),
            });
        }
    };
    let shown = output::say::end();
    match result {
        Ok(()) if shown => ExitCode::SUCCESS,
        Ok(()) => ExitCode::FAILURE,
        Err(error) => {
            output::say::aside(format_args!("virtual-board: {error}"));
            ExitCode::FAILURE
        }
    }
}

/// Time after which an answer is reported as late: the shortest time-out of the known clients.
const LATE: Duration = Duration::from_millis(10);

/// Runs it and prints the table.
#[cfg(feature = "bringup")]
pub fn bringup(image: &Path, frames: u32, estimates: Option<&Path>, json: Option<&Path>) -> Result<(), Error> {
    let estimates = estimates.map(::bringup::judge::estimates).transpose().map_err(Error::Report)?.unwrap_or_default();
    let told = &mut |said: &str| say::line(said);
    let (judgement, _) = virtual_board::bringup::run(image, &Options::default(), frames, &estimates, told)?;
    if let Some(path) = json {
        let text = serde_json::to_string_pretty(&judgement).map_err(std::io::Error::from).map_err(Error::Report)?;
        kept::write(path, text + "\n").map_err(Error::Report)?;
    }
    say::text(judgement.text());
    match judgement.failed {
        0 => Ok(()),
        failed => Err(Error::Failed(failed)),
    }
}

/// Runs it, prints the table, writes figures and pictures.
pub fn demo(image: &Path, json: Option<&Path>, out: &Path, quick: bool) -> Result<(), Error> {
    let (figures, run) = demo::run(image, quick)?;
    // The files first: the reader of the output may close the pipe.
    let drawn = draw(&run, &figures.forces, out);
    if let Some(path) = json {
        let written = serde_json::to_string_pretty(&figures).map_err(std::io::Error::from);
        let written = written.and_then(|text| kept::write(path, text + "\n"));
        written.map_err(|error| sim::run::RunError::from(format!("cannot write {}: {error}", path.display())))?;
    }
    say::line(format_args!("sha-256  {} ({} bytes, as flashed)\n", figures.image_sha256, figures.image_bytes));
    say::text(table(&figures.checks, &figures.forces));
    say::line(format_args!("\ntrace    {}", figures.trace_sha256));
    if let Some(repeated) = &figures.repeated_trace_sha256 {
        say::line(format_args!("repeated {repeated}"));
    }
    let (virtual_s, wall_s) = (figures.virtual_time_s, figures.wall_time_s);
    say::line(format_args!("time     {virtual_s:.1} s of virtual time in {wall_s:.1} s"));
    drawn?.iter().for_each(|path| say::line(format_args!("picture  {}", path.display())));
    if let Some(path) = json {
        say::line(format_args!("figures  {}", path.display()));
    }
    match missed(&figures.checks) {
        0 => Ok(()),
        missed => Err(Error::Missed(missed)),
    }
}

/// Serves the board until Ctrl-C.
pub fn serve(image: &Path, place: &Place, distance_mm: f64) -> Result<(), Error> {
    let mut setup = Setup::default();
    setup.wall.distance_mm = distance_mm;
    let mut board = Board::warm(Rig::new(image, Plant::new(&setup), &Options::confirmed())?)?;
    let mut port = Port::open(place)?;
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(|why| Error::Client(std::io::Error::other(why)))?;
    say::line(format_args!("serving  {} (DYNAMIXEL Protocol 2.0, 1 Mbaud, ID 1; Ctrl-C ends)", port.name()));
    std::io::stdout().flush()?;
    let served = ::serve::serve(&mut board, &mut port, LATE, true)?;
    say::line(served.text());
    Ok(())
}
