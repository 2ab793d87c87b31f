//! Tests and checks, one stage each.

use crate::console::{self, Console, clear_line, cpu_s};
use crate::image::Sizes;
use crate::toolchain;
use crate::{cores, docs, flash, host, image, install, timing};
use anyhow::{Context, Result, bail};
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
    stages.stage("core and host tests", |console| host::test(&mut host::tests(&["--no-fail-fast"]), console));
    stages.stage("fit of a sensor to recordings", |console| {
        let mut command = install::sensor_test(console)?;
        console.run(&mut command)
    });
    let image = stages.stage("flash image", |console| {
        let image = image::firmware(console)?;
        console.print(&image.summary());
        Ok(image)
    });
    let image = || image.as_ref().context("the flash image did not build; see above");
    stages.stage("size of the flash image", |console| {
        let sizes = Sizes::of(image()?)?;
        console.print(&sizes.verdict());
        sizes.check()
    });
    stages.stage("panic-free proof", image::prove_panic_free);
    stages.stage("emulated Cortex-M4F against this machine", cores::test_m4);
    stages.stage("example for another board", cores::example);
    stages.stage("timing model against published measurements", |console| timing::check(console).map(drop));
    stages.stage("virtual board", |console| {
        let python = install::bus_python(console)?;
        let mut command = host::tests(&["--test", "board"]);
        command.env("FINGERTIP_IMAGE", &image()?.elf).env("FINGERTIP_PYTHON", &python);
        host::test(&mut command, console)
    });
    stages.stage("Python package on a served finger", |console| {
        let python = install::bus_python(console)?;
        let mut command = host::tests(&["--test", "served", "--", "--ignored", "--skip", "long_"]);
        host::test(command.env("FINGERTIP_PYTHON", &python), console)
    });
    stages.stage("reports in a browser", |console| {
        let mut command = install::browser_test(console)?;
        let sim = host::Program::sim("sim").build(console)?;
        command.env("FINGERTIP_SIM", sim.get_program());
        console.run(command.env("FINGERTIP_REPORTS", host::made("tmp")?.join("report")))
    });
    stages.finish("test")
}

/// Runs the larger sizes (tests whose names begin with `long_`), and checks the tables of proofs and fits.
fn long(mut stages: Stages) -> Result<()> {
    stages.stage("long core and host tests", |console| {
        let python = install::bus_python(console)?;
        let mut command = host::tests(&["--no-fail-fast", "--", "--ignored", "long_"]);
        host::test(command.env("FINGERTIP_PYTHON", &python), console)
    });
    stages.stage("long tests on the virtual board", |console| {
        let image = image::firmware(console)?;
        let checking = image::checking(flash::BRINGUP, console)?;
        let mut command = host::tests(&["--test", "board", "--", "--ignored", "long_"]);
        command.env("FINGERTIP_IMAGE", &image.elf).env("FINGERTIP_BRINGUP", &checking.elf);
        host::test(&mut command, console)
    });
    stages.stage("proofs of the model's error bounds", |console| host::run_tool("prove", &["--check"], console));
    stages.stage("fit of thousands of tactile images", |console| host::run_tool("fit", &["--check"], console));
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
    stages.stage("format", |console| {
        console.run(console::cargo("fmt").args(["--all", "--check"]))?;
        for folder in APART {
            let manifest = format!("{folder}/Cargo.toml");
            console.run(console::cargo("fmt").args(["--manifest-path", &manifest, "--check"]))?;
        }
        Ok(())
    });
    stages.stage("lints, host", |console| {
        console.run(clippy(console::cargo("clippy").args(ALL).arg("--all-targets")))?;
        // `--all-targets` passes over tests that plain `cargo test` does not run.
        console.run(clippy(console::cargo("clippy").args(ALL).arg("--test=board")))
    });
    stages
        .stage("lints, least features", |console| console.run(clippy(console::cargo("clippy").args(LEAST.split(' ')))));
    stages.stage("lints, microcontroller", |console| {
        toolchain::ensure(console)?;
        // In the profile of the images, whose proc macros are compiled already.
        console.run(clippy(toolchain::cargo("clippy").arg("--release").args(IMAGES.split(' '))))?;
        let target = cores::TARGET_OF_EXAMPLE;
        toolchain::ensure_for(&[target], "programs of other boards are checked for it", console)?;
        for folder in APART {
            console.run(clippy(image::apart("clippy", folder, target, &[]).arg("--release")))?;
        }
        Ok(())
    });
    stages.stage("documentation", |console| {
        let mut command = console::cargo("doc");
        command.args(ALL).args(["--no-deps", "--document-private-items", "--ignore-rust-version"]);
        console.run(command.env("RUSTDOCFLAGS", "-D warnings"))
    });
    stages.stage("licences and sources of the dependencies", |console| {
        let program = docs::deny(console)?;
        console.run(Command::new(program).args(["check", "bans", "licenses", "sources"]))
    });
    stages.finish("lint")
}

fn clippy(command: &mut Command) -> &mut Command {
    command.args(["--ignore-rust-version", "--", "-D", "warnings"])
}

/// A sequence of checks, each a line with its cost; what failed is shown in full.
#[derive(Default)]
pub struct Stages {
    /// Names, with CPU time of compiling, CPU time of all else, and time by the clock, s.
    done: Vec<(String, [f64; 3])>,
    failed: Vec<String>,
}

impl Stages {
    /// Runs a stage; `None` where it failed.
    ///
    /// Stages do not depend on each other's order: a stage that lacks what an earlier one failed to make fails too.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Console) -> Result<T>) -> Option<T> {
        println!("{name} ...");
        let mut console = Console::captured();
        let (start, before_s) = (Instant::now(), cpu_s());
        let result = work(&mut console);
        let (clock_s, built_s) = (start.elapsed().as_secs_f64(), console.built_s);
        self.done.push((name.into(), [built_s, cpu_s() - before_s - built_s, clock_s]));
        clear_line();
        match result {
            Ok(value) => {
                // Cargo's closing line of each test binary that ran a test.
                let idle = " 0 passed; 0 failed; 0 ignored";
                let lines = console.text().lines().filter(|line| line.starts_with("test result:"));
                lines.filter(|line| !line.contains(idle)).for_each(|line| println!("    {line}"));
                println!("ok     {clock_s:7.1} s  {name}");
                Some(value)
            }
            Err(error) => {
                println!("{}", console.text());
                // The tests that failed again at the end, where one looks first.
                let lines = console.text().lines().filter(|line| line.starts_with("test "));
                lines.filter(|line| line.ends_with(" ... FAILED")).for_each(|line| println!("    {line}"));
                println!("{error:#}");
                println!("FAILED {clock_s:7.1} s  {name}");
                self.failed.push(name.into());
                None
            }
        }
    }

    pub fn finish(self, what: &str) -> Result<()> {
        println!("\n{:>10} {:>8} {:>8}  seconds of CPU time", "compiling", "running", "clock");
        let all = [0, 1, 2].map(|place| self.done.iter().map(|(_, costs)| costs[place]).sum());
        for (name, [built_s, ran_s, clock_s]) in self.done.iter().chain([&("all\n".into(), all)]) {
            println!("{built_s:10.1} {ran_s:8.1} {clock_s:8.1}  {name}");
        }
        if !self.failed.is_empty() {
            bail!("{} failed: {}", what, self.failed.join("; "));
        }
        println!("{what}: all passed");
        Ok(())
    }
}
