//! Python environments: independent clients of the bus, readers of a sweep's files, and the fit of a real sensor.

use crate::console::Console;
use crate::{apt, paths, sim};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A virtual environment in the build folder.
pub struct Environment {
    /// Folder of the environment.
    pub folder: &'static str,
    /// Installed packages, with their versions.
    pub packages: &'static [&'static str],
    /// The names by which a program imports that, with commas between.
    pub imports: &'static str,
    /// Purpose.
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
/// No Python, no `venv`, or no package; the text says what to install.
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

// The fit of a real sensor to recordings: a script on NumPy and SciPy.

const LEAST_SQUARES: Environment = Environment {
    folder: "venv-sensor",
    packages: &["numpy==2.4.6", "scipy==1.17.1"],
    imports: "numpy, scipy.optimize",
    does: "`cargo xtask sensor` solves its least squares with them",
};

/// Returns the command that starts a script of the fit, in an environment with what it imports.
pub fn script(name: &str, console: &mut Console) -> Result<Command> {
    let mut command = Command::new(environment(&LEAST_SQUARES, console)?);
    // -B leaves no compiled files among the sources.
    command.arg("-B").arg(paths::root().join("host-tests/sensor").join(name));
    Ok(command)
}

/// Fits a sensor to recordings.
pub fn sensor(args: &sim::Args, console: &mut Console) -> Result<()> {
    sim::start(script("fit.py", console)?.args(&args.arguments))
}
