//! Every test, a stage each.

use crate::{
    bringup, browser, console, cores, host, image, proof, python, qemu, sensor,
    size::Sizes,
    stages::Stages,
    timing,
    toolchain::{self, Choice},
};
use anyhow::{Context, Result};
use std::process::Command;

/// Flags of `cargo xtask test`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask test\n  cargo test    (core and host only, needs nothing but Rust)")]
pub struct Args {}

/// Runs all tests.
///
/// # Errors
/// Names the stages that failed.
pub fn run(_args: &Args, choice: Choice) -> Result<()> {
    let mut stages = Stages::default();
    stages.stage("core and host tests", |console| host::test(console::cargo("test").arg("--no-fail-fast"), console));
    stages.stage("fit of a sensor to recordings", |console| {
        let mut command = sensor::script("test_fit.py", console)?;
        console.run(&mut command)
    });
    let image = stages.stage("flash image", |console| {
        let image = image::firmware(choice, console)?;
        console.print(&image.summary());
        Ok(image)
    });
    let image = || image.as_ref().context("the flash image did not build; see above");
    stages.stage("size of the flash image", |console| {
        let sizes = Sizes::of(image()?)?;
        console.print(&sizes.verdict());
        sizes.check()
    });
    stages.stage("panic-free proof", |console| proof::run(choice, console));
    stages.stage("emulated Cortex-M4F against this machine", |console| qemu::test(choice, console));
    stages.stage("emulated cores of other boards against this machine", |console| {
        cores::page(choice, console).map(|page| console.print(&cores::table(&page)))
    });
    stages.stage("example for another board", |console| cores::example(choice, console));
    stages.stage("timing model against published measurements", |console| timing::check(choice, console));
    stages.stage("virtual board", |console| {
        let python = python::ensure(console)?;
        let mut command = on_a_board(&["--lib", "--test", "board"]);
        let checking = bringup::build(toolchain::ensure(choice, console)?, console)?;
        command.env("FINGERTIP_IMAGE", &image()?.elf).env("FINGERTIP_PYTHON", &python);
        command.env("FINGERTIP_BRINGUP", &checking.elf);
        host::test(&mut command, console)
    });
    stages.stage("Python package on a served finger", |console| {
        let python = python::ensure(console)?;
        // The wheel's builder reads the sources of every platform, also those that no build here needs.
        console.prepare(console::cargo("fetch").args(["--locked", "--quiet"]))?;
        let mut command = on_a_board(&["--test", "python"]);
        command.env("FINGERTIP_PYTHON", &python).args(["--", "--ignored"]);
        host::test(&mut command, console)
    });
    stages.stage("stream to Foxglove", |console| host::test(&mut on_a_board(&["--test", "stream"]), console));
    stages.stage("reports in a browser", |console| {
        let program = browser::ensure(console)?;
        host::test(on_a_board(&["--test", "report"]).env("FINGERTIP_CHROMIUM", &program), console)
    });
    stages.finish("test")
}

/// Tests of the packages that stand around an image or a served finger. All of them are selected each time, so that they
/// agree on the features of what they share, and it is compiled once.
fn on_a_board(targets: &[&str]) -> Command {
    let mut command = host::cargo("test", "virtual-board");
    command.args(["--package", "serve", "--package", "browser", "--package", "fingertip-cli"]);
    command.args(["--features", "fingertip-cli/foxglove"]).args(targets);
    command
}
