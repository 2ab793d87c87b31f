//! A Python with the package `dynamixel-sdk`, a bus client that nobody here wrote.

use crate::{apt, console::Console, paths};
use anyhow::{Context, Result, ensure};
use std::{path::PathBuf, process::Command};

const PACKAGE: &str = "dynamixel-sdk==4.1.0";

/// Finds or makes the virtual environment, and returns its interpreter.
///
/// # Errors
/// No Python, no `venv`, or no package: says what to install.
pub fn ensure(console: &mut Console) -> Result<PathBuf> {
    let folder = paths::target().join("venv");
    let python = folder.join("bin").join("python");
    if has_package(&python) {
        return Ok(python);
    }
    console.say("Making a Python environment with `dynamixel-sdk`: the example and its test talk to the board by it.");
    let make = || Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).output();
    // Debian splits `venv` off Python, and may lack Python altogether.
    if !make().is_ok_and(|output| output.status.success()) {
        apt::ensure(&["python3", "python3-venv"], "the Python client of the bus", console)?;
        let output = make().context("cannot start python3")?;
        ensure!(output.status.success(), "python3 -m venv: {}", String::from_utf8_lossy(&output.stderr));
    }
    console
        .run(Command::new(&python).args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-cache-dir",
            "--disable-pip-version-check",
            PACKAGE,
        ]))
        .with_context(|| format!("pip cannot install {PACKAGE}: is a package index in reach?"))?;
    ensure!(has_package(&python), "{PACKAGE} is installed in {}, but does not import", paths::shown(&folder));
    Ok(python)
}

fn has_package(python: &PathBuf) -> bool {
    Command::new(python).args(["-c", "import dynamixel_sdk"]).output().is_ok_and(|output| output.status.success())
}
