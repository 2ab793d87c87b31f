//! The project's commands. `cargo xtask --help` lists them; each does its own set-up.

mod cluster;
mod console;
mod cores;
mod docs;
mod flash;
mod host;
mod image;
mod install;
mod sim;
mod test;
mod timing;
mod toolchain;

use clap::{Parser, Subcommand};
use std::io::Write as _;
use std::process::ExitCode;

/// The fingertip's commands: watch it, test it, build it, flash it.
///
/// Each command installs what it needs, and reports what and why; once set up, everything works offline.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Watch the flash image touch an object, hold the force and release, on the virtual board
    Demo(sim::DemoArgs),
    /// Run a scene: a text file that names what is simulated around the fingertip
    #[command(disable_help_flag = true, after_help = examples("sim wall --out target/wall|sim --list"))]
    Sim(sim::Args),
    /// Run a scene many times: over values of its keys, over seeds, on all cores and machines
    #[command(disable_help_flag = true, after_help = examples("sweep raspberry --seeds 1000"))]
    Sweep(sim::Args),
    /// Run fingers that are drawn as a usual build brings them about, and judge each by what it must never do
    #[command(disable_help_flag = true, after_help = examples("population ordinary --fingers 100"))]
    Population(sim::Args),
    /// Say how much of the force's error each weakness of a usual finger makes
    #[command(disable_help_flag = true, after_help = examples("budget --fingers 300"))]
    Budget(sim::Args),
    /// Fit a real sensor's characteristic, creep or gains to recordings, and judge the fit on others
    #[command(
        after_help = "Examples:\n  cargo xtask sensor fit cycles.csv --judge others.csv --json fit.json\n  cargo xtask sensor gains presses.csv --judge others.csv --json gains.json --parameters array.toml\n  cargo xtask sensor gains --help    (all that it takes)"
    )]
    Sensor(sim::Args),
    /// Serve a simulated finger in real time for any DYNAMIXEL client, behind a pseudo-terminal or a TCP port
    #[command(disable_help_flag = true, after_help = examples("serve --pty /tmp/finger|serve raspberry --tcp 7000|\
        serve --board virtual --pty /tmp/finger    (the flash image on the emulated board)"))]
    Serve(sim::Args),
    /// Run every test: core, host, panic-free proof, QEMU, virtual board, reports in a browser
    Test(test::Args),
    /// Build the flash image and print its path, size and SHA-256
    #[command(after_help = "Examples:\n  cargo xtask build")]
    Build,
    /// Build the flash image and write it to a board with probe-rs
    Flash(flash::Args),
    /// Check a bare NUCLEO-F446RE, or the emulated board: clocks, watchdogs, flash, converters, scan, the loop, cycles
    Bringup(flash::BringupArgs),
    /// Run the core on an emulated Cortex-M4F and compare it bit for bit with the host
    #[command(after_help = "Examples:\n  cargo xtask qemu")]
    Qemu,
    /// Run the loop on every core that QEMU emulates, compare with the host, and renew the table of docs/porting.md
    #[command(after_help = "Examples:\n  cargo xtask cores")]
    Cores,
    /// Estimate the cycles of an image's regions on a Cortex-M4F, with and without the flash's wait states
    Timing(timing::Args),
    /// Measure what accuracy costs in time: every variant of every kernel, with tables and plots
    Study(timing::StudyArgs),
    /// Prove the contact model's error bounds over whole input ranges: some minutes on two cores
    #[command(disable_help_flag = true, after_help = examples("prove --quick|prove --check"))]
    Prove(sim::Args),
    /// Judge the contact's fit on thousands of pictures, and renew the tables of docs/contact.md
    #[command(disable_help_flag = true, after_help = examples("fit --quick|fit --check"))]
    Fit(sim::Args),
    /// Prove the control step free of panics and of floating-point calls
    #[command(after_help = "Examples:\n  cargo xtask panic-free")]
    PanicFree,
    /// Check format, lints, documentation and licences
    #[command(after_help = "Examples:\n  cargo xtask lint")]
    Lint,
    /// Renew the generated files, or check that they are fresh
    Docs(docs::Args),
    /// Make the packages that others take, test them from a project outside of this workspace, and check the Python package
    #[command(after_help = "Examples:\n  cargo xtask package")]
    Package,
    /// Try the examples for clusters here: Slurm's tasks, GNU parallel, the Kubernetes job's shell, DuckDB
    #[command(after_help = "Examples:\n  cargo xtask cluster")]
    Cluster,
}

/// Examples of a command whose program has a help of its own.
fn examples(list: &str) -> String {
    let help = list.split(' ').next().unwrap_or_default().to_owned() + " --help    (all that it takes)";
    list.split('|').chain([&*help]).fold("Examples:".into(), |text, example| text + "\n  cargo xtask " + example)
}

fn main() -> ExitCode {
    match run(&Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> anyhow::Result<()> {
    match &cli.command {
        Command::Demo(args) => sim::demo(args),
        Command::Sim(args) => sim::on_board("sim", args),
        Command::Sweep(args) => sim::native("sweep", args),
        Command::Population(args) => sim::on_board("population", args),
        Command::Budget(args) => sim::native("budget", args),
        Command::Sensor(args) => install::sensor(args),
        Command::Serve(args) => sim::serve(args),
        Command::Test(args) => test::run(args),
        Command::Build => image::firmware().map(|image| console::print(&image.summary())),
        Command::Flash(args) => flash::run(args),
        Command::Bringup(args) => flash::bringup(args),
        Command::Qemu => cores::run_m4(),
        Command::Cores => cores::run_all(),
        Command::Timing(args) => timing::run(args),
        Command::Study(args) => timing::study(args),
        Command::Prove(args) => host::run_tool("prove", &args.arguments),
        Command::Fit(args) => host::run_tool("fit", &args.arguments),
        Command::PanicFree => image::prove_panic_free(),
        Command::Lint => test::lint(),
        Command::Docs(args) => docs::run(args),
        Command::Package => docs::package(),
        Command::Cluster => cluster::run(),
    }
}
