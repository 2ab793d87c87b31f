//! Pythons with packages of others: clients of the bus that nobody here wrote, and what reads a sweep's files.

use crate::{apt, console::Console, paths};
use anyhow::{Context, Result, ensure};
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// A virtual environment in the build folder.
pub struct Environment {
    /// Its folder.
    pub folder: &'static str,
    /// What is installed in it, with its version.
    pub packages: &'static [&'static str],
    /// The names by which a program imports that, with commas between.
    pub imports: &'static str,
    /// What it is for.
    pub does: &'static str,
}

const BUS: Environment = Environment {
    folder: "venv",
    packages: &["dynamixel-sdk==4.1.0", "rustypot==1.13.1", "mypy==2.4.1", "maturin==1.9.4"],
    imports: "dynamixel_sdk, rustypot, mypy, maturin",
    does: "tests talk to the board by the first two, and check and build the Python package by the others",
};

/// Finds or makes the environment with the bus client, and returns its interpreter.
pub fn ensure(console: &mut Console) -> Result<PathBuf> {
    environment(&BUS, console)
}

/// Finds or makes a virtual environment, and returns its interpreter.
///
/// # Errors
/// No Python, no `venv`, or no package: says what to install.
pub fn environment(environment: &Environment, console: &mut Console) -> Result<PathBuf> {
    let Environment { folder, packages, imports, does } = environment;
    let folder = paths::target().join(folder);
    let python = folder.join("bin").join("python");
    if has(&python, imports) {
        return Ok(python);
    }
    let list = packages.join(" ");
    console.say(&format!("Making a Python environment with `{list}`: {does}."));
    let make = || Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).output();
    // Debian splits `venv` off Python, and may lack Python altogether.
    if !make().is_ok_and(|output| output.status.success()) {
        apt::ensure(&["python3", "python3-venv"], "a Python environment", console)?;
        let output = make().context("cannot start python3")?;
        ensure!(output.status.success(), "python3 -m venv: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--no-cache-dir", "--disable-pip-version-check"]).args(*packages);
    console
        .prepare(&mut install)
        .with_context(|| format!("pip cannot install {list}: is a package index in reach?"))?;
    ensure!(has(&python, imports), "{list} is installed in {}, but does not import", paths::shown(&folder));
    Ok(python)
}

fn has(python: &Path, imports: &str) -> bool {
    Command::new(python).args(["-c", &format!("import {imports}")]).output().is_ok_and(|output| output.status.success())
}
