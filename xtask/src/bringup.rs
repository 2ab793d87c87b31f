//! The first hour with a board: an image that checks a bare NUCLEO-F446RE, or the emulated one, and its judge.

use crate::console::Console;
use crate::host::{self, Program};
use crate::image;
use crate::toolchain::{self, Choice, Toolchain};
use crate::{flash, paths, sim, timing};
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Name of the image and its package.
pub const NAME: &str = "bringup";
/// Folder in which Linux names the ST-LINK's port.
const BY_ID: &str = "/dev/serial/by-id";
const ST_LINK: &str = "STLINK";

/// Flags of `cargo xtask bringup`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask bringup --json board.json\n  cargo xtask bringup --board virtual\n\n\
    docs/bringup.md goes on from there. `cargo xtask flash` puts the firmware back.")]
pub struct Args {
    /// A NUCLEO-F446RE with nothing attached, or the emulated board
    #[arg(long, value_enum, default_value_t = Board::Nucleo)]
    board: Board,
    /// Number of frames for which the rows are read back; a million on a NUCLEO, which takes 100 s, a thousand emulated
    #[arg(long)]
    frames: Option<u32>,
    /// Write the figures to this file, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The ST-LINK's serial port, where it is not found by its name
    #[arg(long, value_name = "PORT")]
    port: Option<PathBuf>,
    /// Which probe, where there are several, as `probe-rs list` shows it
    #[arg(long, value_name = "PROBE")]
    probe: Option<String>,
    /// Write nothing to the board: the image is on it already, copied to the NUCLEO's drive for example
    #[arg(long)]
    flashed: bool,
    /// Leave the kernels' estimates out: they take QEMU, and another image
    #[arg(long)]
    without_estimates: bool,
}

/// Board that runs the image.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Board {
    /// The board on the desk
    Nucleo,
    /// The emulated board
    Virtual,
}

/// Builds the image, runs it and judges what it reports. This process ends as the judge does.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    // First, as it takes no time: without a board there is no wait for a build.
    let port = (args.board == Board::Nucleo).then(|| args.port.clone().map_or_else(find_port, Ok)).transpose()?;
    if port.is_some() && !args.flashed {
        flash::need_probe_rs()?;
    }
    let toolchain = toolchain::ensure(choice, console)?;
    let image = image::checking(toolchain, NAME, console)?;
    console.say(&image.summary());
    let estimates = if args.without_estimates { None } else { Some(estimates(toolchain, console)?) };
    let mut command = match port {
        None => {
            let mut command = host::SCENE_BOARD.build(console)?;
            command.arg(NAME).arg("--image").arg(std::path::absolute(&image.elf)?);
            command
        }
        Some(port) => {
            let mut command = Program { package: NAME, name: "bringup-host", with: host::SHARED }.build(console)?;
            if !args.flashed {
                flash::put(&image, args.probe.as_deref(), console)?;
            }
            command.arg("--port").arg(port).arg("--sha256").arg(image.sha256());
            command
        }
    };
    if let Some(frames) = args.frames {
        command.arg("--frames").arg(frames.to_string());
    }
    for (flag, path) in [("--json", &args.json), ("--estimates", &estimates)] {
        if let Some(path) = path {
            command.arg(flag).arg(std::path::absolute(path)?);
        }
    }
    sim::start(&mut command)
}

/// The kernels' estimated cycles, with the flash's wait states, of the inputs that the image has: a file with a line
/// each.
fn estimates(toolchain: Toolchain, console: &mut Console) -> Result<PathBuf> {
    let folder = paths::made("study")?;
    let [kept, full, file] = ["kept.bin", "few.bin", "few.txt"].map(|name| folder.join(name));
    let mut inputs = Program::tool("study").build(console)?;
    console.run(inputs.arg("few").arg(&kept).arg(&full))?;
    let study = image::build(toolchain, "study", "study", console)?;
    let run = timing::measure(&study, Some(&full), console)?;
    let call = run.regions.first().map_or(0, |region| region.flash.median);
    let mut text = String::new();
    for region in &run.regions {
        // A string takes every write.
        let _ = writeln!(text, "{} {}", region.flash.median.saturating_sub(call), run.name(region.region));
    }
    fs::write(&file, text).with_context(|| format!("cannot write {}", paths::shown(&file)))?;
    Ok(file)
}

/// The only ST-LINK's port.
fn find_port() -> Result<PathBuf> {
    let folder = Path::new(BY_ID);
    let names = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    let ports: Vec<_> = names.filter(|path| path.to_string_lossy().contains(ST_LINK)).collect();
    match &ports[..] {
        [port] => Ok(port.clone()),
        [] => bail!(
            "no ST-LINK in {BY_ID}: connect the NUCLEO by its USB cable, or name its port with --port.\n\
             Without a board, --board virtual runs the same image in the emulator."
        ),
        several => {
            let names = several.iter().map(|port| port.display().to_string()).collect::<Vec<_>>();
            bail!("{} ST-LINKs: name one with --port and --probe: {}", several.len(), names.join(", "))
        }
    }
}
