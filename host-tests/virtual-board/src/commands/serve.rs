//! `virtual-board serve`.

use output::say;
use serve::{Place, Port};
use sim::plant::{Plant, Setup};
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;
use virtual_board::serve::Board;
use virtual_board::{Error, Options, Rig};

/// Time after which an answer is reported as late: the shortest time-out of the known clients.
const LATE: Duration = Duration::from_millis(10);

/// Image to serve, and its port.
#[derive(Debug, clap::Args)]
pub struct Arguments {
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
}

/// Serves the board until Ctrl-C.
pub fn run(arguments: &Arguments) -> Result<(), Error> {
    let place = arguments.tcp.map_or_else(|| Place::Pty(arguments.pty.clone()), Place::Tcp);
    let mut setup = Setup::default();
    setup.wall.distance_mm = arguments.distance_mm;
    let mut board = Board::warm(Rig::new(&arguments.image, Plant::new(&setup), &Options::confirmed())?)?;
    let mut port = Port::open(&place)?;
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(|why| Error::Client(std::io::Error::other(why)))?;
    say::line(format_args!("serving  {} (DYNAMIXEL Protocol 2.0, 1 Mbaud, ID 1; Ctrl-C ends)", port.name()));
    std::io::stdout().flush()?;
    let served = serve::serve(&mut board, &mut port, LATE, true)?;
    say::line(served.text());
    Ok(())
}
