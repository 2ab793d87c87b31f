//! Format, lints, documentation and licences.

use crate::{
    console::{self, Console},
    image, paths,
    stages::Stages,
    toolchain::{self, Choice, TARGET, Toolchain},
};
use anyhow::{Context, Result, ensure};
use std::{path::PathBuf, process::Command};

/// The version is part of the promise that a passing check passes tomorrow.
const CARGO_DENY: &str = "cargo-deny@0.20.2";
/// Every image that is emulated or linked as a proof, and its feature.
const IMAGES: [(&str, &str); 5] =
    [("qemu", "qemu"), ("panic-free", "proof"), ("timing", "timing"), ("timing-check", "timing"), ("study", "study")];

/// Runs all checks that are no tests.
///
/// # Errors
/// Names the checks that failed.
pub fn run(choice: Choice) -> Result<()> {
    let mut stages = Stages::default();
    stages.stage("format", |console| console.run(console::cargo("fmt").args(["--all", "--check"])));
    stages.stage("lints, host", |console| console.run(&mut clippy(&["--workspace", "--all-targets"])));
    stages.stage("lints, what the demonstration is built of", |console| {
        for package in ["host-tests", "virtual-board"] {
            console.run(&mut clippy(&["--package", package, "--no-default-features", "--lib", "--bins"]))?;
        }
        Ok(())
    });
    stages.stage("lints, plugin", |console| {
        console.run(&mut clippy(&["--package", "m4-timing", "--features", "plugin", "--all-targets"]))
    });
    stages.stage("lints, microcontroller", |console| {
        let toolchain = toolchain::ensure(choice, console)?;
        ensure!(toolchain == Toolchain::Native, "Debian's Rust has no clippy for {TARGET}: rustup's target is needed");
        console.run(&mut denying_warnings(image::flashed(toolchain, "clippy")))?;
        for (name, feature) in IMAGES {
            console.run(&mut denying_warnings(image::emulated(toolchain, "clippy", name, feature)))?;
        }
        Ok(())
    });
    stages.stage("documentation", |console| {
        let mut command = console::cargo("doc");
        command.args(["--workspace", "--no-deps", "--document-private-items", "--ignore-rust-version"]);
        console.run(command.env("RUSTDOCFLAGS", "-D warnings"))
    });
    stages.stage("licences and sources of the dependencies", |console| {
        let program = ensure_deny(console)?;
        console.run(Command::new(program).args(["check", "bans", "licenses", "sources"]))
    });
    stages.finish("lint")
}

fn denying_warnings(mut clippy: Command) -> Command {
    clippy.args(["--ignore-rust-version", "--", "-D", "warnings"]);
    clippy
}

fn clippy(arguments: &[&str]) -> Command {
    let mut command = console::cargo("clippy");
    command.args(arguments);
    denying_warnings(command)
}

/// Finds or installs cargo-deny, in the build folder.
///
/// # Errors
/// It is missing and cannot be installed.
pub fn ensure_deny(console: &mut Console) -> Result<PathBuf> {
    let folder = paths::target().join("tools");
    let program = folder.join("bin").join("cargo-deny");
    if !program.is_file() {
        console.say(&format!("Installing {CARGO_DENY} to {}: it checks the licences.", paths::shown(&folder)));
        // Unoptimised: it compiles in a third of the time, and runs for seconds.
        let mut install = console::cargo("install");
        install.args([CARGO_DENY, "--locked", "--debug", "--no-default-features", "--root"]).arg(&folder);
        console.run(&mut install).context("cannot install cargo-deny: is crates.io in reach?")?;
    }
    Ok(program)
}
