//! The compiler for the firmware: rustup's bare-metal target, or Debian's Rust where rustup's server is out of reach.

use crate::{apt, console, console::Console, paths};
use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use std::{path::PathBuf, process::Command};

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

/// Finds or installs a compiler for the firmware.
///
/// # Errors
/// Neither rustup nor Debian could provide one: says what was tried and what to do.
pub fn ensure(choice: Choice, console: &mut Console) -> Result<Toolchain> {
    let native = || -> Result<Toolchain> { Ok(Toolchain::Native) };
    if choice != Choice::Debian && has_target() {
        return native();
    }
    let by_rustup = match choice {
        Choice::Debian => None,
        _ => match add_target(console) {
            Ok(()) => return native(),
            Err(error) => Some(error),
        },
    };
    if let Some(error) = by_rustup {
        if choice == Choice::Rustup {
            return Err(error);
        }
        console.say(&format!("{error:#}\nThe Rust distribution server is out of reach: taking Debian's Rust instead."));
        return debian(console).with_context(|| {
            format!(
                "no compiler for {TARGET}.\n\
                 Tried `rustup target add {TARGET}`: {error:#}.\n\
                 Tried Debian's `{}`: see below.\n\
                 Do either by hand, or open the way to static.rust-lang.org or to a Debian mirror.",
                DEBIAN_PACKAGES.join(" ")
            )
        });
    }
    debian(console)
}

fn debian(console: &mut Console) -> Result<Toolchain> {
    apt::ensure(&DEBIAN_PACKAGES, "building the firmware without rustup's target", console)?;
    console.say("Building the firmware with Debian's Rust (rustc-web), with `core` from source.");
    Ok(Toolchain::Debian)
}

/// Whether the compiler that cargo takes has `core` for the target.
fn has_target() -> bool {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let Ok(output) = Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]).output() else {
        return false;
    };
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let Ok(files) = folder.read_dir() else { return false };
    files.flatten().any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
}

fn add_target(console: &mut Console) -> Result<()> {
    if paths::find_program("rustup").is_none() {
        bail!("no rustup in PATH");
    }
    console.say(&format!("Adding rustup's target {TARGET}: the firmware is compiled for it."));
    console.run(Command::new("rustup").args(["target", "add", TARGET]))?;
    if !has_target() {
        bail!("rustup added {TARGET} to another toolchain than the one that cargo takes");
    }
    Ok(())
}
