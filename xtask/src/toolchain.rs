//! The compiler for the firmware: that of this command, with rustup's bare-metal targets.

use crate::console;
use crate::{host, install};
use anyhow::{Context, Result, ensure};
use std::path::PathBuf;
use std::process::Command;
use std::{env, iter};

/// The microcontroller, in the compiler's words.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// `cargo <subcommand>` for the firmware's target.
pub fn cargo(subcommand: &str) -> Command {
    cargo_for(subcommand, TARGET, &[])
}

/// `cargo <subcommand>` for a target, with flags for the compiler.
pub fn cargo_for(subcommand: &str, target: &str, flags: &[&str]) -> Command {
    let mut command = console::cargo(subcommand);
    command.args(["--target", target]).arg("--target-dir").arg(target_dir(flags));
    let flags: Vec<_> = short_paths().chain(flags.iter().map(|flag| (*flag).into())).collect();
    // Added to the flags of `.cargo/config.toml`. Cargo does not find a target by a name with a dot here.
    let key = if target.contains('.') { "'cfg(target_os = \"none\")'" } else { target };
    command.arg("--config").arg(format!("target.{key}.rustflags={flags:?}"));
    command
}

/// Folder of the release images for the firmware's target.
pub fn images() -> PathBuf {
    images_for(TARGET, &[])
}

/// Folder of the release images for a target, built with these flags.
pub fn images_for(target: &str, flags: &[&str]) -> PathBuf {
    target_dir(flags).join(target).join("release")
}

/// Build folder: builds with other flags would rebuild each other's work in one.
fn target_dir(flags: &[&str]) -> PathBuf {
    if flags.is_empty() { host::target() } else { host::target().join("flagged") }
}

/// Flags for the compiler that replace the folders of this checkout and of other crates by short names. The path of a
/// source that can panic is part of the image, and the image must be the same bytes on every machine.
pub fn short_paths() -> impl Iterator<Item = String> {
    let checkout = format!("--remap-path-prefix={}=fingertip", host::root().display());
    iter::once(checkout).chain(sources().map(|crates| format!("--remap-path-prefix={}=crates", crates.display())))
}

/// Folder in which cargo keeps the sources of other crates.
pub fn sources() -> Option<PathBuf> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".cargo")))?;
    Some(home.join("registry").join("src"))
}

/// Installs the firmware's target where it is missing.
pub fn ensure() -> Result<()> {
    ensure_for(&[TARGET], "the firmware is compiled for it")
}

/// Installs the targets that are missing.
pub fn ensure_for(targets: &[&str], why: &str) -> Result<()> {
    let missing = || targets.iter().copied().filter(|target| !has_target(target)).collect::<Vec<_>>();
    if missing().is_empty() {
        return Ok(());
    }
    let list = targets.join(", ");
    let is_there = host::find_program("rustup").is_some();
    ensure!(is_there, "there is no rustup in PATH: the target {list} is needed, because {why}");
    // Another command may add them meanwhile; those that are there do no harm.
    let _alone = install::alone()?;
    console::say(&format!("Adding rustup's target {list}: {why}."));
    let added = console::prepare(Command::new("rustup").args(["target", "add"]).args(targets));
    added.context("the Rust distribution server (static.rust-lang.org) gave no target")?;
    ensure!(missing().is_empty(), "rustup added {list} to another toolchain than the one that cargo takes");
    Ok(())
}

/// True if the compiler that cargo takes has `core` for the target.
fn has_target(target: &str) -> bool {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let Ok(output) = Command::new(rustc).args(["--print", "target-libdir", "--target", target]).output() else {
        return false;
    };
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let Ok(files) = folder.read_dir() else { return false };
    files.flatten().any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
}
