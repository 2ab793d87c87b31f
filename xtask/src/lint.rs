//! Format, lints, documentation and licences.

use crate::{
    console, cores, image,
    stages::Stages,
    toolchain::{self, Choice, TARGET, Toolchain},
    tools,
};
use anyhow::{Result, ensure};
use std::process::Command;

/// Every image that is emulated or linked as a proof, and its feature.
const IMAGES: [(&str, &str); 5] =
    [("qemu", "qemu"), ("panic-free", "proof"), ("timing", "timing"), ("timing-check", "timing"), ("study", "study")];

/// Programs of other boards, each a workspace of its own.
const APART: [&str; 2] = [cores::EXAMPLE, cores::LOOP];

/// Runs all checks that are no tests.
pub fn run(choice: Choice) -> Result<()> {
    let mut stages = Stages::default();
    stages.stage("format", |console| {
        console.run(console::cargo("fmt").args(["--all", "--check"]))?;
        for folder in APART {
            let manifest = format!("{folder}/Cargo.toml");
            console.run(console::cargo("fmt").args(["--manifest-path", &manifest, "--check"]))?;
        }
        Ok(())
    });
    stages.stage("lints, host", |console| console.run(&mut clippy(&["--workspace", "--all-targets"])));
    stages.stage("lints, what the demonstration is built of", |console| {
        for package in ["sim", "virtual-board"] {
            console.run(&mut clippy(&["--package", package, "--no-default-features", "--lib", "--bins"]))?;
        }
        Ok(())
    });
    stages.stage("lints, what is built where it is asked for", |console| {
        console.run(&mut clippy(&["--package", "m4-timing", "--features", "plugin", "--all-targets"]))?;
        console.run(&mut clippy(&["--package", "fingertip-cli", "--features", "foxglove", "--all-targets"]))
    });
    stages.stage("lints, microcontroller", |console| {
        let toolchain = toolchain::ensure(choice, console)?;
        ensure!(toolchain == Toolchain::Native, "Debian's Rust has no clippy for {TARGET}: rustup's target is needed");
        console.run(&mut denying_warnings(image::flashed(toolchain, "clippy")))?;
        for (name, feature) in IMAGES {
            console.run(&mut denying_warnings(image::emulated(toolchain, "clippy", name, feature)))?;
        }
        console.run(&mut denying_warnings(image::checked(toolchain, "clippy", "bringup")))?;
        let target = cores::TARGET_OF_EXAMPLE;
        let toolchain =
            toolchain::ensure_for(choice, &[target], "programs of other boards are checked for it", console)?;
        for folder in APART {
            console.run(&mut denying_warnings(image::apart(toolchain, "clippy", folder, target, &[])))?;
        }
        Ok(())
    });
    stages.stage("documentation", |console| {
        let mut command = console::cargo("doc");
        command.args(["--workspace", "--no-deps", "--document-private-items", "--ignore-rust-version"]);
        console.run(command.env("RUSTDOCFLAGS", "-D warnings"))
    });
    stages.stage("licences and sources of the dependencies", |console| {
        let program = tools::DENY.ensure(console)?;
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
