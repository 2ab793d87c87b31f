//! Tools of cargo's that the checks need, installed in the build folder.

use crate::{
    console::{self, Console},
    paths,
};
use anyhow::{Context, Result, bail};
use std::{path::PathBuf, process::Command};

/// A tool of cargo's; the version is part of the promise that a passing check passes tomorrow.
pub struct Tool {
    /// Its name and that of its program.
    name: &'static str,
    version: &'static str,
    /// What it does here.
    does: &'static str,
}

/// Checks licences and sources.
pub const DENY: Tool = Tool { name: "cargo-deny", version: "0.20.2", does: "checks the licences" };
/// Lists public items. This version reads what rustdoc of Rust 1.95 writes; another Rust may need another one.
const PUBLIC_API: Tool = Tool { name: "cargo-public-api", version: "0.52.0", does: "lists what the packages offer" };

impl Tool {
    /// Finds or installs it.
    pub fn ensure(&self, console: &mut Console) -> Result<PathBuf> {
        let Self { name, version, does } = self;
        let folder = paths::target().join("tools");
        let program = folder.join("bin").join(name);
        if !program.is_file() {
            console.say(&format!("Installing {name} {version} to {}: it {does}.", paths::shown(&folder)));
            // Unoptimised: it compiles in a third of the time, and runs for seconds.
            let mut install = console::cargo("install");
            install.arg(format!("{name}@{version}")).args(["--locked", "--debug", "--no-default-features", "--root"]);
            let installed = console.prepare(install.arg(&folder));
            installed.with_context(|| format!("cannot install {name}: is crates.io in reach?"))?;
        }
        Ok(program)
    }
}

/// Installs all of them.
pub fn ensure_all(console: &mut Console) -> Result<()> {
    [DENY, PUBLIC_API].iter().try_for_each(|tool| tool.ensure(console).map(drop))
}

/// The public items of a package, a line each.
pub fn public_items(package: &str, console: &mut Console) -> Result<String> {
    let mut command = Command::new(PUBLIC_API.ensure(console)?);
    command.args(["public-api", "-sss", "--package", package, "--target-dir"]).arg(paths::target().join("api"));
    // What rustdoc writes for programs is not stable: this lets a stable compiler write it.
    command.env("RUSTC_BOOTSTRAP", "1").current_dir(paths::root());
    let output = command.output().with_context(|| console::show(&command))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{said}{} {} cannot list {package}", PUBLIC_API.name, PUBLIC_API.version);
    }
    Ok(String::from_utf8(output.stdout)?)
}
