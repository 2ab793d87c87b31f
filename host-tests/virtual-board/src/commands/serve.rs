//! `virtual-board serve`.

use fingertip::shipped::address;
use host_tests::plant::{Setup, World};
use std::io::Write as _;
use std::path::PathBuf;
use virtual_board::serve::{Place, Port, serve};
use virtual_board::{Error, Options, Rig};

/// The image is up by then.
const BOOT_MS: u64 = 20;
/// Its address on the bus, and how long it may take to answer.
const ID: u8 = 1;
const WAIT_NS: u64 = 20_000_000;

/// What to serve and where.
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
    let mut setup = Setup::default();
    setup.wall.distance_mm = arguments.distance_mm;
    let mut rig = Rig::new(&arguments.image, World::new(&setup), &Options::default())?;
    // Up, and compiled by the emulator as far as an answer takes, before anybody can ask: clients do not wait long.
    rig.run_ms(BOOT_MS)?;
    let up = rig.client(WAIT_NS, |bus| {
        bus.ping(ID)?;
        bus.read_u32(ID, address::PRESENT_FORCE_MN)?;
        bus.write_u32(ID, address::GOAL_FORCE_MN, 0)
    })?;
    up.map_err(|why| Error::Client(std::io::Error::other(format!("the board does not answer: {why}"))))?;
    let place = arguments.tcp.map_or_else(|| Place::Pty(arguments.pty.clone()), Place::Tcp);
    let mut port = Port::open(&place)?;
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(|why| Error::Client(std::io::Error::other(why)))?;
    println!("serving  {} (DYNAMIXEL Protocol 2.0, 1 Mbaud, ID 1; Ctrl-C ends)", port.name());
    std::io::stdout().flush()?;
    let served = serve(&mut rig, &mut port)?;
    println!(
        "served   {:.1} s of virtual time in {:.1} s, {} bytes in, {} out",
        served.virtual_s, served.wall_s, served.received, served.sent
    );
    Ok(())
}
