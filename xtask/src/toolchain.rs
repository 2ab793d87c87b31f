//! The compiler for the firmware: rustup's bare-metal target, or Debian's Rust where rustup's server is out of reach.

use crate::{apt, console, console::Console, paths};
use anyhow::{Context, Result, anyhow, bail};
use clap::ValueEnum;
use std::{env, path::PathBuf, process::Command};

/// The microcontroller, in the compiler's words.
pub const TARGET: &str = "thumbv7em-none-eabihf";
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];

/// What the user asks for.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// The installed target, rustup's, or Debian's: the first that works
    Auto,
    /// The toolchain that runs this command, with rustup's target
    Rustup,
    /// Debian's rustc-web, which builds `core` from source
    Debian,
}

/// A compiler that can build the firmware.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Toolchain {
    /// The compiler that cargo would take anyway has the target.
    Native,
    /// Debian's compiler.
    Debian,
}

impl Toolchain {
    /// `cargo <subcommand>` for the target.
    pub fn cargo(self, subcommand: &str) -> Command {
        let mut command = match self {
            Self::Native => console::cargo(subcommand),
            Self::Debian => {
                let mut command = Command::new("/usr/bin/cargo");
                command.arg(subcommand).arg("-Zbuild-std=core");
                command.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1");
                command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "ld.lld");
                // Cargo put the libraries of the toolchain that runs this program there.
                command.env_remove("LD_LIBRARY_PATH").env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
                command.arg("--target-dir").arg(self.target_dir());
                command
            }
        };
        command.args(["--target", TARGET]);
        if let Some(short) = short_paths() {
            // Added to the flags of `.cargo/config.toml`.
            command.arg("--config").arg(format!("target.{TARGET}.rustflags=[{short:?}]"));
        }
        command
    }

    /// Where its release images lie.
    pub fn images(self) -> PathBuf {
        self.target_dir().join(TARGET).join("release")
    }

    /// Two compilers in one folder would rebuild each other's work.
    fn target_dir(self) -> PathBuf {
        match self {
            Self::Native => paths::target(),
            Self::Debian => paths::target().join("debian"),
        }
    }
}

/// The flag that names the sources of other crates by their place in cargo's home: where a panic would be is part of
/// the image, which is the same bytes on every machine.
pub fn short_paths() -> Option<String> {
    Some(format!("--remap-path-prefix={}=crates", sources()?.display()))
}

/// Where cargo keeps the sources of other crates.
pub fn sources() -> Option<PathBuf> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".cargo")))?;
    Some(home.join("registry").join("src"))
}

/// Finds or installs a compiler for the firmware.
///
/// # Errors
/// Neither rustup nor Debian could provide one: says what was tried and what to do.
pub fn ensure(choice: Choice, console: &mut Console) -> Result<Toolchain> {
    if choice == Choice::Debian {
        return debian(console);
    }
    if has_target() {
        return Ok(Toolchain::Native);
    }
    // Debian's compiler once taken is taken again: asking an unreachable server each time would cost minutes.
    if choice == Choice::Auto && Toolchain::Debian.target_dir().is_dir() && apt::all_installed(&DEBIAN_PACKAGES) {
        return debian(console);
    }
    let Err(rustup) = add_target(console) else { return Ok(Toolchain::Native) };
    if choice == Choice::Rustup {
        return Err(rustup);
    }
    console.say(&format!("{rustup:#}: taking Debian's Rust instead."));
    debian(console).map_err(|debian| {
        anyhow!(
            "no compiler for {TARGET}.\n\
             - rustup: {rustup:#}\n\
             - Debian: {debian:#}\n\
             Open the way to static.rust-lang.org or to a Debian mirror, or do one of the two by hand."
        )
    })
}

fn debian(console: &mut Console) -> Result<Toolchain> {
    apt::ensure(&DEBIAN_PACKAGES, "building the firmware without rustup's target", console)?;
    console.say("Building the firmware with Debian's Rust (rustc-web), with `core` from source.");
    Ok(Toolchain::Debian)
}

/// Whether the compiler that cargo takes has `core` for the target.
fn has_target() -> bool {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let Ok(output) = Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]).output() else {
        return false;
    };
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let Ok(files) = folder.read_dir() else { return false };
    files.flatten().any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
}

fn add_target(console: &mut Console) -> Result<()> {
    if paths::find_program("rustup").is_none() {
        bail!("there is no rustup in PATH");
    }
    console.say(&format!("Adding rustup's target {TARGET}: the firmware is compiled for it."));
    let added = console.prepare(Command::new("rustup").args(["target", "add", TARGET]));
    added.context("the Rust distribution server (static.rust-lang.org) gave no target")?;
    if !has_target() {
        bail!("rustup added {TARGET} to another toolchain than the one that cargo takes");
    }
    Ok(())
}
