//! `virtual-board`: the flash image on the emulated board.

use ::bringup::judge;
use clap::{Parser, Subcommand};
use output::say;
use serve::{Place, Port};
use sim::demo::{draw, missed, table};
use sim::plant::Setup;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use virtual_board::board::Surroundings;
use virtual_board::demo;
#[cfg(feature = "scenes")]
use virtual_board::scene::simulate;
use virtual_board::serve::warm;
use virtual_board::{Error, Options, Rig};

/// Runs the flash image on an emulated STM32 with the simulated fingertip around it.
#[derive(Debug, Parser)]
#[command(name = "virtual-board", version)]
struct Arguments {
    /// The image, an ELF for the STM32F446RE.
    #[arg(long, value_name = "ELF", global = true, default_value = "target/thumbv7em-none-eabihf/release/firmware")]
    image: PathBuf,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs the image of `cargo xtask bringup` and judges its report.
    Bringup(judge::Options),
    /// Touches an object, holds forces, releases it; checks the figures and draws pictures.
    Demo {
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
    Sim(sim::cli::Args),
    /// Runs drawn fingers with the image.
    #[cfg(feature = "scenes")]
    Population(sim::population::Args),
}

fn main() -> ExitCode {
    let Arguments { image, command } = Arguments::parse();
    let result = match command {
        Command::Bringup(options) => bringup(&image, &options),
        Command::Demo { json, out, quick } => demo(&image, json.as_deref(), &out, quick),
        Command::Serve { pty, tcp, distance_mm } => {
            serve(&image, &tcp.map_or_else(|| Place::Pty(pty), Place::Tcp), distance_mm)
        }
        #[cfg(feature = "scenes")]
        Command::Sim(scene) => {
            use sim::cli::{Board, answer};
            return answer(&scene, &|of, watch| match scene.board {
                Board::Native => sim::native::board(of, watch),
                Board::Virtual | Board::Both => simulate(&image, of, watch).map_err(Into::into),
            });
        }
        #[cfg(feature = "scenes")]
        Command::Population(population) => {
            use sim::population::{Board, answer};
            return answer(&population, &|of, watch| match population.board {
                Board::Native => sim::native::board(of, watch),
                Board::Calibrated => sim::native::calibrated::board(of, watch),
                Board::Virtual => simulate(&image, of, watch).map_err(Into::into),
            });
        }
    };
    let shown = say::end();
    if let Err(error) = &result {
        say::aside(format_args!("virtual-board: {error}"));
    }
    if shown && result.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Time after which an answer is reported as late: the shortest time-out of the known clients.
const LATE: Duration = Duration::from_millis(10);

fn bringup(image: &Path, options: &judge::Options) -> Result<(), Error> {
    let (judgement, _) = virtual_board::bringup::run(image, options)?;
    if judgement.failed == 0 { Ok(()) } else { Err(Error::Failed(judgement.failed)) }
}

/// Runs it, prints the table, writes figures and pictures.
fn demo(image: &Path, json: Option<&Path>, out: &Path, quick: bool) -> Result<(), Error> {
    let (figures, run) = demo::run(image, quick)?;
    // The files first: the reader of the output may close the pipe.
    let drawn = draw(&run, &figures.forces, out);
    json.map_or(Ok(()), |path| judge::write(path, &figures))?;
    say::line(format_args!("sha-256  {} ({} bytes, as flashed)\n", figures.image_sha256, figures.image_bytes));
    say::text(table(&figures.checks));
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
    let missed = missed(&figures.checks);
    if missed == 0 { Ok(()) } else { Err(Error::Failed(missed)) }
}

fn serve(image: &Path, place: &Place, distance_mm: f64) -> Result<(), Error> {
    let mut setup = Setup::default();
    setup.wall.distance_mm = distance_mm;
    let mut board = Rig::new(image, Surroundings::plant(&setup), &Options::confirmed())?;
    warm(&mut board)?;
    let mut port = Port::open(place)?;
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(std::io::Error::other)?;
    say::line(format_args!("serving  {} (DYNAMIXEL Protocol 2.0, 1 Mbaud, ID 1; Ctrl-C ends)", port.name()));
    std::io::stdout().flush()?;
    let served = ::serve::serve(&mut board, &mut port, LATE, true)?;
    say::line(served.text());
    Ok(())
}
