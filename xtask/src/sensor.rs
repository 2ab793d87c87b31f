//! The fit of a real sensor to recordings: a script on NumPy and SciPy.

use crate::{
    console::Console,
    paths,
    python::{self, Environment},
    sim,
};
use anyhow::Result;
use std::process::Command;

const LEAST_SQUARES: Environment = Environment {
    folder: "venv-sensor",
    packages: &["numpy==2.4.6", "scipy==1.17.1"],
    imports: "numpy, scipy.optimize",
    does: "`cargo xtask sensor` solves its least squares with them",
};

/// Returns the command that starts a script of the fit, in an environment with what it imports.
pub fn script(name: &str, console: &mut Console) -> Result<Command> {
    let mut command = Command::new(python::environment(&LEAST_SQUARES, console)?);
    // -B leaves no compiled files among the sources.
    command.arg("-B").arg(paths::root().join("host-tests/sensor").join(name));
    Ok(command)
}

/// Fits a sensor to recordings.
pub fn run(args: &sim::Args, console: &mut Console) -> Result<()> {
    sim::start(script("fit.py", console)?.args(&args.arguments))
}
