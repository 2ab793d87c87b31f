//! `serve`: a scene's finger, simulated in real time, for any client of the bus.

use clap::Parser;
use output::say;
use serve::{Place, Port};
use sim::native::served::Bus;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Time after which an answer is late: 2 ms, and the delay at power-on.
const LATE: Duration = Duration::from_micros(2_500);

/// Serves a simulated finger in real time: the native core and link, for any client of the bus.
///
/// The finger begins as at power-on: torque off, not tared. Commands are read from the standard input, a line each:
/// `remove`, `put`, `move MM`, `fault KIND`, `mend`, `state`, `help`.
#[derive(Debug, Parser)]
#[command(
    name = "serve",
    version,
    after_help = "Examples:\n  serve\n  serve raspberry --pty /tmp/finger\n  \
    serve my-scene.toml --tcp 7000 --set effects.noise.rms_codes=3\n  \
    echo move 3 | serve wall --pty /tmp/finger\n  \
    cargo xtask serve --board virtual    (the flash image on the emulated board)"
)]
struct Args {
    /// The scene: a file, or a name out of the library; its script, events, metrics and bounds are left out
    #[arg(default_value = "wall")]
    scene: String,
    /// Makes a symbolic link of this name to the pseudo-terminal
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    pty: Option<PathBuf>,
    /// Takes a TCP port of this machine instead of a pseudo-terminal; 0 takes any that is free
    #[arg(long, value_name = "PORT")]
    tcp: Option<u16>,
    /// Replaces the scene's seed
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Replaces a value of the scene; may be given many times
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    set: Vec<String>,
}

fn main() -> ExitCode {
    let ended = run(&Args::parse()).map_err(say::aside);
    if ended.is_ok() && say::end() { ExitCode::SUCCESS } else { ExitCode::from(2) }
}

fn run(args: &Args) -> Result<(), String> {
    let scene = sim::cli::load(&args.scene, &args.set, args.seed)?;
    let mut bus = Bus::new(&scene).map_err(|why| format!("{}: {why}", scene.name))?;
    let fingers = scene.table("hand").whole("fingers");
    let place = args.tcp.map_or_else(|| Place::Pty(args.pty.clone()), Place::Tcp);
    let mut port = Port::open(&place).map_err(|why| why.to_string())?.with_commands();
    let stop = port.stopper();
    ctrlc::set_handler(move || stop.stop()).map_err(|why| format!("cannot wait for Ctrl-C: {why}"))?;
    let ids = if fingers > 1 { format!("IDs 1 to {fingers}") } else { "ID 1".into() };
    let (name, baud) = (port.name(), bus.baud());
    say::line(format_args!("serving  {name} (DYNAMIXEL Protocol 2.0, {baud} baud, {ids}; Ctrl-C ends)"));
    let (name, about) = (&scene.name, &scene.about);
    say::line(format_args!("scene    {name}: {about} (simulated on the native core; `help` lists commands)"));
    io::stdout().flush().map_err(|why| format!("cannot say where it serves: {why}"))?;
    let Ok(served) = serve::serve(&mut bus, &mut port, LATE, false);
    say::line(served.text());
    Ok(())
}
