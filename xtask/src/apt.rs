//! Debian packages, installed where they are missing.

use crate::{console::Console, paths};
use anyhow::{Context, Result, bail};
use std::process::Command;

/// Makes sure of Debian packages.
///
/// # Errors
/// No Debian, no root, or apt-get cannot get them: says what to install by hand.
pub fn ensure(packages: &[&str], why: &str, console: &mut Console) -> Result<()> {
    let missing: Vec<&str> = packages.iter().copied().filter(|package| !installed(package)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list = missing.join(" ");
    if paths::find_program("apt-get").is_none() {
        bail!("{why} needs the Debian packages `{list}`, and there is no apt-get here: install their like by hand");
    }
    if !is_root() {
        bail!("{why} needs the Debian packages `{list}`: run `sudo apt-get install {list}` and try again");
    }
    console.say(&format!("Installing the Debian packages `{list}`: {why} needs them."));
    if install(&missing, console).is_ok() {
        return Ok(());
    }
    console.say("apt-get may know old package lists only: updating them.");
    console.run(Command::new("apt-get").args(["update", "-qq"]))?;
    install(&missing, console)
        .with_context(|| format!("apt-get cannot install `{list}`, which {why} needs: is a package mirror in reach?"))
}

/// Whether nothing of these packages is missing.
pub fn all_installed(packages: &[&str]) -> bool {
    packages.iter().all(|package| installed(package))
}

fn install(packages: &[&str], console: &mut Console) -> Result<()> {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive").args(["install", "-qq", "-y", "--no-install-recommends"]);
    console.run(command.args(packages))
}

fn installed(package: &str) -> bool {
    let query = Command::new("dpkg-query").args(["-W", "-f", "${Status}", package]).output();
    query.is_ok_and(|output| output.stdout.ends_with(b" installed"))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
