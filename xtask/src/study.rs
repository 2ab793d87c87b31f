//! What accuracy costs in time: every variant of every kernel on the emulated Cortex-M4F, judged on this machine.

use crate::{
    console::Console,
    host::Program,
    image, paths,
    progress::IMAGE,
    timing,
    toolchain::{self, Choice, Toolchain},
};
use anyhow::{Context, Result};
use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

/// The image and its feature.
const NAME: &str = "study";
/// The profile of everything but the firmware's own code.
const PROFILE: &str = "study";

/// Flags of `cargo xtask study`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask study\n  cargo xtask study --check\n  \
    cargo xtask study --json study.json --out /tmp/study")]
pub struct Args {
    /// Change nothing; fail where a figure of docs/study.md, the README or a picture is stale
    #[arg(long, conflicts_with = "out")]
    check: bool,
    /// Write the figures to a file, an object a line
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write pages and pictures to a folder instead of the documentation
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the study and renews or checks its page, its table in the README and its pictures.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let toolchain = toolchain::ensure(choice, console)?;
    let folder = paths::made("study")?;
    let inputs = folder.join("inputs.bin");
    let judge = Program::tool("study");
    let mut command = judge.build(console)?;
    console.run(command.arg("inputs").arg(&inputs))?;
    let shipped = image::build(toolchain, NAME, NAME, console)?;
    let shipped = measured(&shipped, &inputs, &folder.join("shipped.txt"), console)?;
    let quick = measured(&build_quick(toolchain, console)?, &inputs, &folder.join("quick.txt"), console)?;
    let mut command = judge.build(console)?;
    command.arg("report").arg(&shipped).arg(&quick).args(args.check.then_some("--check"));
    for (flag, path) in [("--json", &args.json), ("--out", &args.out)] {
        if let Some(path) = path {
            command.arg(flag).arg(std::path::absolute(path).with_context(|| paths::shown(path))?);
        }
    }
    console.run(&mut command)
}

/// The image as quick as the compiler makes it, without what keeps the firmware's small.
fn build_quick(toolchain: Toolchain, console: &mut Console) -> Result<PathBuf> {
    let mut command = image::emulated(toolchain, "build", NAME, NAME);
    command.args(["--profile", PROFILE]);
    // Instead of the flags that `.cargo/config.toml` has for the target.
    let flags = ["-C", "opt-level=3"].map(String::from).into_iter().chain(toolchain::short_paths());
    // Flags may hold blanks: a separator that no path has.
    command.env("CARGO_ENCODED_RUSTFLAGS", flags.collect::<Vec<_>>().join("\u{1f}"));
    console.build(&mut command, "the study, as quick as can be", IMAGE)?;
    Ok(toolchain.images().with_file_name(PROFILE).join(NAME))
}

/// Runs an image; what it said and what it cost, in a file.
fn measured(image: &Path, inputs: &Path, file: &Path, console: &mut Console) -> Result<PathBuf> {
    let run = timing::measure(image, Some(inputs), console)?;
    let mut text = run.output;
    for measured in &run.regions {
        // A string takes every write.
        let _ = write!(text, "cost {}", measured.region);
        for figure in [&measured.instructions, &measured.low, &measured.estimate, &measured.high, &measured.flash] {
            let _ = write!(text, " {} {}", figure.median, figure.max);
        }
        text.push('\n');
    }
    fs::write(file, text).with_context(|| format!("cannot write {}", paths::shown(file)))?;
    Ok(file.into())
}
