//! `fingertip`: a fingertip controller from the host's side.

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use clap_complete::Shell;
use fingertip_cli::client::Reach;
use fingertip_cli::commands::{calibrate, capture, device, each, params, press, record, share, stop, stream, view};
use fingertip_cli::{Client, Error};
use serde_json::json;
use std::io::{self, Write as _};
use std::process::ExitCode;

/// Finds, watches, records, sets up and moves a fingertip controller on its bus.
///
/// Names carry their units: force_mn is in mN. Exit code 0: done; 1: refused or not reached; 2: not understood, and
/// nothing was sent; 3: a force was reached, but not held; 130: a signal came while a command moved or stopped the finger,
/// which was stopped.
#[derive(Parser)]
#[command(
    name = "fingertip",
    version,
    arg_required_else_help = true,
    after_help = "Examples:\n  \
        fingertip scan\n  \
        fingertip --port /dev/ttyACM0 info\n  \
        export FINGERTIP_PORT=/tmp/finger    (a simulated one: cargo xtask serve --pty /tmp/finger)\n  \
        fingertip tare && fingertip press 1.5\n  \
        fingertip stop\n  \
        fingertip view\n  \
        fingertip record --seconds 10 --rate-hz 200 force.csv"
)]
struct Cli {
    #[command(flatten)]
    reach: Reach,
    /// Answer in JSON, for scripts, with an array for several IDs; an error is the last line of standard error: {"error": TEXT, "exit_code": CODE}
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Look for controllers: on all ports or the one named, at all speeds
    Scan(device::Scan),
    /// Show identity and status of the controller
    #[command(after_help = "Examples:\n  fingertip info\n  fingertip info --json")]
    Info,
    /// Own the bus for any number of clients: one commands, all watch, anyone stops
    Share(share::Args),
    /// Watch map, force, goal, mode and faults live
    View(view::Args),
    /// Stream states live to Foxglove, over a WebSocket
    #[cfg_attr(not(feature = "foxglove"), command(hide = true))]
    Stream(stream::Args),
    /// Record states with the controller's own times, as CSV or MCAP
    Record(record::Args),
    /// Keep every frame from a tare on, on the board itself, and write a file that replays to the bit
    Capture(capture::Args),
    /// Feed captures through the core on this machine, and compare
    Replay(capture::Replay),
    /// Read, write, save, back up and restore the parameters
    #[command(subcommand)]
    Params(params::Command),
    /// Measure the zero of every taxel; nothing may touch the tip
    Tare(stop::Tare),
    /// Prove the motor's direction and measure the drive, by small motions in the air
    Commission(calibrate::Commission),
    /// Measure Young's modulus of the tip, by presses onto a hard plate
    Identify(calibrate::Identify),
    /// Touch, hold a force for a time, release
    Press(press::Args),
    /// Stop the finger in any mode: release, torque off, measurements aborted, bus watchdog off
    Stop(stop::Stop),
    /// Measure gains and modulus by presses onto a hard flat plate, and the scale of forces by a kitchen scale
    Calibrate(calibrate::Calibrate),
    /// Clear what stopped the motor, or report what prevents it
    #[command(after_help = "Examples:\n  fingertip recover")]
    Recover,
    /// Measure how long answers take: reads without a pause
    Latency(device::Latency),
    /// Print a shell's completions
    #[command(
        after_help = "Examples:\n  fingertip completions bash > ~/.local/share/bash-completion/completions/fingertip"
    )]
    Completions {
        /// Which shell
        shell: Shell,
    },
}

fn main() -> ExitCode {
    let cli = with_examples(Cli::command()).try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = match cli {
        Ok(cli) => cli,
        Err(why) if why.use_stderr() && std::env::args_os().any(|argument| argument == "--json") => {
            let text = why.to_string();
            return failed(text.strip_prefix("error: ").unwrap_or(&text).trim_end(), 2, true);
        }
        Err(why) => why.exit(),
    };
    match run(&cli).and_then(|()| fingertip_cli::commands::said()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => failed(&why.to_string(), why.exit_code(), cli.json),
    }
}

/// Reports an error; JSON in one line, so that it is found behind what else is on standard error.
fn failed(why: &str, code: u8, as_json: bool) -> ExitCode {
    let _ = if as_json {
        writeln!(io::stderr(), "{}", json!({ "error": why, "exit_code": code }))
    } else {
        writeln!(io::stderr(), "fingertip: {why}")
    };
    code.into()
}

/// Gives each subcommand without examples those of its parent's that name it.
fn with_examples(command: clap::Command) -> clap::Command {
    let parent = command.get_name().to_owned();
    let all = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    command.mut_subcommands(|command| {
        let name = format!(" {parent} {} ", command.get_name());
        let own: Vec<&str> = all.lines().filter(|line| format!("{line} ").contains(&name)).collect();
        let stays = own.is_empty() || command.get_after_help().is_some();
        with_examples(if stays { command } else { command.after_help(format!("Examples:\n{}", own.join("\n"))) })
    })
}

fn run(cli: &Cli) -> Result<(), Error> {
    let connect = || Client::connect(&cli.reach);
    let for_each = |command: &dyn Fn(&mut Client) -> Result<(), Error>| {
        each(&mut Client::open(&cli.reach)?, &cli.reach.ids, cli.json, true, &[], |client| {
            client.check().and_then(|()| command(client))
        })
    };
    match &cli.command {
        Command::Scan(args) => device::scan(args, &cli.reach, cli.json),
        Command::Info => for_each(&|client| device::info(client, cli.json)),
        Command::Share(args) => share::run(args, &cli.reach, cli.json),
        Command::View(args) => view::run(args, &mut connect()?),
        Command::Stream(args) => stream::run(args, &mut connect()?),
        Command::Record(args) => record::run(args, args.mcap()?, &mut connect()?, cli.json),
        Command::Capture(args) => args.check().and_then(|()| capture::run(args, &mut connect()?, cli.json)),
        Command::Replay(args) => capture::replay_all(args, cli.json),
        Command::Params(command) => params::run(command, &mut connect()?, cli.json),
        Command::Tare(args) => for_each(&|client| stop::tare(args, client, cli.json)),
        Command::Commission(args) => calibrate::commission(args, &mut connect()?, cli.json),
        Command::Press(args) => press::run(args, &mut connect()?, cli.json),
        Command::Stop(args) => stop::run(args, &cli.reach, cli.json),
        Command::Identify(args) => calibrate::identify(args, &mut connect()?, cli.json),
        Command::Calibrate(args) => calibrate::calibrate(args, &mut connect()?, cli.json),
        Command::Recover => for_each(&|client| stop::recover(client, cli.json)),
        Command::Latency(args) => device::latency(args, &mut connect()?, cli.json),
        Command::Completions { shell } => {
            let mut text = Vec::new();
            clap_complete::generate(*shell, &mut Cli::command(), "fingertip", &mut text);
            fingertip_cli::commands::say(String::from_utf8_lossy(&text).trim_end());
            Ok(())
        }
    }
}
