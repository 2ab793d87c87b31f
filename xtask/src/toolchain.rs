//! The compiler for the firmware: rustup's bare-metal target, or Debian's Rust where rustup's server is out of reach.

use crate::console::{self, Console};
use crate::{host, install};
use anyhow::{Context, Result, anyhow, bail};
use clap::ValueEnum;
use std::path::PathBuf;
use std::process::Command;
use std::{env, iter};

/// The microcontroller, in the compiler's words.
pub const TARGET: &str = "thumbv7em-none-eabihf";
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];

/// Source of the compiler that the user requests.
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
    Debian,
}

impl Toolchain {
    /// `cargo <subcommand>` for the firmware's target.
    pub fn cargo(self, subcommand: &str) -> Command {
        self.cargo_for(subcommand, TARGET, &[])
    }

    /// `cargo <subcommand>` for a target, with flags for the compiler.
    pub fn cargo_for(self, subcommand: &str, target: &str, flags: &[&str]) -> Command {
        let mut command = match self {
            Self::Native => console::cargo(subcommand),
            Self::Debian => {
                let mut command = Command::new("/usr/bin/cargo");
                command.arg(subcommand).arg("-Zbuild-std=core");
                command.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1");
                let variable = target.replace(['-', '.'], "_").to_uppercase();
                command.env(format!("CARGO_TARGET_{variable}_LINKER"), "ld.lld");
                // Cargo put the libraries of the toolchain that runs this program there.
                command.env_remove("LD_LIBRARY_PATH").env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
                command
            }
        };
        command.args(["--target", target]).arg("--target-dir").arg(self.target_dir(flags));
        let flags: Vec<_> = short_paths().chain(flags.iter().map(|flag| (*flag).into())).collect();
        // Added to the flags of `.cargo/config.toml`. Cargo does not find a target by a name with a dot here.
        let key = if target.contains('.') { "'cfg(target_os = \"none\")'" } else { target };
        command.arg("--config").arg(format!("target.{key}.rustflags={flags:?}"));
        command
    }

    /// Folder of its release images for the firmware's target.
    pub fn images(self) -> PathBuf {
        self.images_for(TARGET, &[])
    }

    /// Folder of its release images for a target, built with these flags.
    pub fn images_for(self, target: &str, flags: &[&str]) -> PathBuf {
        self.target_dir(flags).join(target).join("release")
    }

    /// Build folder: two compilers, or builds with other flags, would rebuild each other's work in one.
    fn target_dir(self, flags: &[&str]) -> PathBuf {
        let mut folder = host::target();
        folder.extend((self == Self::Debian).then_some("debian"));
        folder.extend((!flags.is_empty()).then_some("flagged"));
        folder
    }
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

/// Finds or installs a compiler for the firmware.
pub fn ensure(choice: Choice, console: &mut Console) -> Result<Toolchain> {
    ensure_for(choice, &[TARGET], "the firmware is compiled for it", console)
}

/// Finds or installs a compiler for some targets.
pub fn ensure_for(choice: Choice, targets: &[&str], why: &str, console: &mut Console) -> Result<Toolchain> {
    if choice == Choice::Debian {
        return debian(console);
    }
    let missing: Vec<_> = targets.iter().copied().filter(|target| !has_target(target)).collect();
    if missing.is_empty() {
        return Ok(Toolchain::Native);
    }
    // Debian's compiler once taken is taken again: asking an unreachable server each time would cost minutes.
    if choice == Choice::Auto
        && Toolchain::Debian.target_dir(&[]).is_dir()
        && DEBIAN_PACKAGES.iter().all(|name| install::installed(name))
    {
        return debian(console);
    }
    let Err(rustup) = add_targets(&missing, why, console) else { return Ok(Toolchain::Native) };
    if choice == Choice::Rustup {
        return Err(rustup);
    }
    console.say(&format!("{rustup:#}: taking Debian's Rust instead."));
    debian(console).map_err(|debian| {
        anyhow!(
            "no compiler for {}.\n\
             - rustup: {rustup:#}\n\
             - Debian: {debian:#}\n\
             Allow access to static.rust-lang.org or to a Debian mirror, or do one of the two by hand.",
            missing.join(", ")
        )
    })
}

fn debian(console: &mut Console) -> Result<Toolchain> {
    install::packages(&DEBIAN_PACKAGES, "building the firmware without rustup's target", console)?;
    console.say("Building the firmware with Debian's Rust (rustc-web), with `core` from source.");
    Ok(Toolchain::Debian)
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

fn add_targets(targets: &[&str], why: &str, console: &mut Console) -> Result<()> {
    if host::find_program("rustup").is_none() {
        bail!("there is no rustup in PATH");
    }
    // Another command may have added them meanwhile.
    let _alone = install::alone()?;
    let targets: Vec<_> = targets.iter().copied().filter(|target| !has_target(target)).collect();
    if targets.is_empty() {
        return Ok(());
    }
    let list = targets.join(", ");
    console.say(&format!("Adding rustup's target {list}: {why}."));
    let added = console.prepare(Command::new("rustup").args(["target", "add"]).args(&targets));
    added.context("the Rust distribution server (static.rust-lang.org) gave no target")?;
    if !targets.iter().all(|target| has_target(target)) {
        bail!("rustup added {list} to another toolchain than the one that cargo takes");
    }
    Ok(())
}
