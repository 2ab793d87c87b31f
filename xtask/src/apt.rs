//! Debian packages, installed where they are missing.

use crate::{console::Console, paths};
use anyhow::{Context, Result, bail};
use std::{fs, process::Command};

/// Where backports come from, and the key that signs them.
const MIRROR: &str = "http://deb.debian.org/debian";
const KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

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
    console.run(install_command().args(packages))
}

/// Waits for another installation under way.
fn install_command() -> Command {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive");
    command.args(["install", "-qq", "-y", "--no-install-recommends", "-o", "DPkg::Lock::Timeout=600"]);
    command
}

/// Installs the newest version of packages that Debian has for this release, its backports included.
///
/// # Errors
/// No Debian, no root, or apt-get cannot get them: says what to install by hand.
pub fn newest(packages: &[&str], why: &str, console: &mut Console) -> Result<()> {
    let list = packages.join(" ");
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let field = |name| release.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
    let codename = field("VERSION_CODENAME").filter(|_| field("ID") == Some("debian"));
    let Some(codename) = codename.filter(|_| paths::find_program("apt-get").is_some()) else {
        bail!("{why} needs a newer version of `{list}`, and this is no Debian: install it by hand");
    };
    let suite = format!("{codename}-backports");
    if !is_root() {
        bail!("{why} needs a newer version of `{list}`: run `sudo apt-get install -t {suite} {list}` and try again");
    }
    console.say(&format!(
        "Installing the newest `{list}`, from {suite} where {codename} has an older one: {why} needs it."
    ));
    let known = Command::new("apt-cache").arg("policy").output();
    if !known.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(&suite)) {
        let file = format!("/etc/apt/sources.list.d/{suite}.list");
        let line = format!("deb [signed-by={KEYRING}] {MIRROR} {suite} main\n");
        fs::write(&file, line).with_context(|| format!("cannot write {file}"))?;
        console.say(&format!("Added {suite} to apt's sources, in {file}."));
    }
    console.run(Command::new("apt-get").args(["update", "-qq"]))?;
    console
        .run(install_command().args(["-t", &suite]).args(packages))
        .with_context(|| format!("apt-get cannot install `{list}` from {suite}, which {why} needs"))
}

fn installed(package: &str) -> bool {
    let query = Command::new("dpkg-query").args(["-W", "-f", "${Status}", package]).output();
    query.is_ok_and(|output| output.stdout.ends_with(b" installed"))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}
