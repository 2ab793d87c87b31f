//! Tests and checks, one stage each.

use crate::console;
use crate::toolchain;
use crate::{cores, docs, flash, host, image, install, timing};
use anyhow::{Context, Result, ensure};
use std::process::Command;
use std::time::Instant;

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  cargo xtask test\n  cargo xtask test --long    (larger sizes and other cases)\n  \
    cargo test    (core and host only, needs nothing but Rust)"
)]
pub struct Args {
    /// Run larger sizes and the cases that the usual size leaves out, and the campaigns of proofs and fits, instead
    #[arg(long)]
    long: bool,
}

/// Runs every test at its usual size, or larger sizes and what that leaves out.
pub fn run(args: &Args) -> Result<()> {
    let mut stages = Stages::default();
    if args.long {
        return long(stages);
    }
    stages.stage("core and host tests", || host::test(&mut host::tests(&["--no-fail-fast"])));
    stages.stage("fit of a sensor to recordings", || console::run(&mut install::sensor_test()?));
    let image = stages.stage("flash image", || image::firmware().inspect(|image| console::print(&image.summary())));
    let image = || image.as_ref().context("the flash image did not build; see above");
    stages.stage("size of the flash image", || image::sizes(image()?).map(|sizes| console::print(&sizes)));
    stages.stage("panic-free proof", image::prove_panic_free);
    stages.stage("emulated Cortex-M4F against this machine", cores::test_m4);
    stages.stage("example for another board", cores::example);
    stages.stage("timing model against published measurements", || timing::check().map(drop));
    stages.stage("virtual board", || {
        host::test(with_python(&["--test", "board"])?.env("FINGERTIP_IMAGE", &image()?.elf))
    });
    stages.stage("Python package on a served finger", || {
        host::test(&mut with_python(&["--test", "served", "--", "--ignored", "--skip", "long_"])?)
    });
    stages.stage("reports in a browser", || {
        let mut command = install::browser_test()?;
        let sim = host::Program::sim("sim").build()?;
        command.env("FINGERTIP_SIM", sim.get_program());
        console::run(command.env("FINGERTIP_REPORTS", host::made("tmp")?.join("report")))
    });
    stages.finish("test")
}

/// Returns the command that runs tests with clients of the bus in Python.
fn with_python(words: &[&str]) -> Result<Command> {
    let mut command = host::tests(words);
    command.env("FINGERTIP_PYTHON", install::environment(&install::BUS)?);
    Ok(command)
}

/// Runs the larger sizes (tests whose names begin with `long_`), and checks the tables of proofs and fits.
fn long(mut stages: Stages) -> Result<()> {
    stages.stage("long core and host tests", || {
        host::test(&mut with_python(&["--no-fail-fast", "--", "--ignored", "long_"])?)
    });
    stages.stage("long tests on the virtual board", || {
        let image = image::firmware()?;
        let checking = image::checking(flash::BRINGUP)?;
        let mut command = host::tests(&["--test", "board", "--", "--ignored", "long_"]);
        command.env("FINGERTIP_IMAGE", &image.elf).env("FINGERTIP_BRINGUP", &checking.elf);
        host::test(&mut command)
    });
    stages.stage("proofs of the model's error bounds", || host::run_tool("prove", &["--check"]));
    stages.stage("fit of thousands of tactile images", || host::run_tool("fit", &["--check"]));
    stages.finish("test --long")
}

// Format, lints, documentation and licences.

/// Every package, with the features that are off by default.
const ALL: [&str; 2] = ["--workspace", "--features=m4-timing/plugin,fingertip-cli/foxglove"];
/// Programs whose default features somebody leaves out: those of `cargo xtask demo` and the host's. Each is named, because
/// `--bins` passes over one that lacks a feature.
const LEAST: &str = "--package=sim --package=virtual-board --package=fingertip-cli --no-default-features --lib --bin=demo \
                     --bin=virtual-board --bin=fingertip";
/// Every image for the microcontroller: flashed, emulated, or linked as a proof. In one view, what they share is checked once.
const IMAGES: &str = "--package=fingertip --package=images --package=bringup --bins --no-default-features \
    --features=fingertip/firmware,fingertip/measure,images/qemu,images/proof,images/study,bringup/image";

/// Programs of other boards, each a workspace of its own.
const APART: [&str; 2] = [cores::EXAMPLE, cores::LOOP];

pub fn lint() -> Result<()> {
    let mut stages = Stages::default();
    stages.stage("format", || {
        console::run(console::cargo("fmt").args(["--all", "--check"]))?;
        for folder in APART {
            let manifest = format!("{folder}/Cargo.toml");
            console::run(console::cargo("fmt").args(["--manifest-path", &manifest, "--check"]))?;
        }
        Ok(())
    });
    stages.stage("lints, host", || {
        console::run(clippy(console::cargo("clippy").args(ALL).arg("--all-targets")))?;
        // `--all-targets` passes over tests that plain `cargo test` does not run.
        console::run(clippy(console::cargo("clippy").args(ALL).arg("--test=board")))
    });
    stages.stage("lints, least features", || console::run(clippy(console::cargo("clippy").args(LEAST.split(' ')))));
    stages.stage("lints, microcontroller", || {
        toolchain::ensure()?;
        // In the profile of the images, whose proc macros are compiled already.
        console::run(clippy(toolchain::cargo("clippy").arg("--release").args(IMAGES.split(' '))))?;
        let target = cores::TARGET_OF_EXAMPLE;
        toolchain::ensure_for(&[target], "programs of other boards are checked for it")?;
        for folder in APART {
            console::run(clippy(image::apart("clippy", folder, target, &[]).arg("--release")))?;
        }
        Ok(())
    });
    stages.stage("documentation", || {
        let mut command = console::cargo("doc");
        command.args(ALL).args(["--no-deps", "--document-private-items", "--ignore-rust-version"]);
        console::run(command.env("RUSTDOCFLAGS", "-D warnings"))
    });
    stages.stage("licences and sources of the dependencies", || {
        let program = docs::deny()?;
        console::run(Command::new(program).args(["check", "bans", "licenses", "sources"]))
    });
    stages.finish("lint")
}

fn clippy(command: &mut Command) -> &mut Command {
    command.args(["--ignore-rust-version", "--", "-D", "warnings"])
}

/// A sequence of checks, each a line with its time and its CPU time: of compiling and installing, and of running.
#[derive(Default)]
pub struct Stages {
    lines: Vec<String>,
    failed: Vec<String>,
}

impl Stages {
    /// Runs a stage; `None` where it failed.
    ///
    /// Stages do not depend on each other's order: a stage that lacks what an earlier one failed to make fails too.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce() -> Result<T>) -> Option<T> {
        println!("{name} ...");
        let (start, before_s) = (Instant::now(), console::cpu_s());
        let result = work();
        let (clock_s, after_s) = (start.elapsed().as_secs_f64(), console::cpu_s());
        if let Err(error) = &result {
            println!("{error:#}");
            self.failed.push(name.into());
        }
        let [compiling_s, running_s] = [0, 1].map(|kind| after_s[kind] - before_s[kind]);
        let ended = if result.is_ok() { "ok    " } else { "FAILED" };
        let line = format!("{ended} {clock_s:7.1} s  CPU {compiling_s:5.0} + {running_s:5.0} s  {name}");
        println!("{line}");
        self.lines.push(line);
        result.ok()
    }

    pub fn finish(self, what: &str) -> Result<()> {
        let [compiling_s, running_s] = console::cpu_s();
        println!("\n{}", self.lines.join("\n"));
        println!("CPU time: {compiling_s:.0} s of compiling and installing, {running_s:.0} s of running");
        ensure!(self.failed.is_empty(), "{what} failed: {}", self.failed.join("; "));
        println!("{what}: all passed");
        Ok(())
    }
}
