//! This machine: its paths, and programs of the workspace that run here, built with a line of progress, then started.

use crate::console;
use anyhow::{Context, Result};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::{env, fs};

/// Folder of all programs that run here, in the build folder: that of cargo's own profile `dev`, which tests have too.
pub const PROGRAMS: &str = "debug";

/// Selects all tests, with the features that [`SHARED`] gives to programs: crates that both use are compiled once.
pub const TESTS: &str = "--workspace --features=fingertip-cli/foxglove --ignore-rust-version";
/// Shows a dot for each test that passes.
const QUIET: &str = "--quiet";
/// Selects the packages that bring most dependencies, next to a program's own: cargo unifies their features.
pub const SHARED: &str = "--package=virtual-board --package=serve --package=fingertip-cli \
                          --features=fingertip-cli/foxglove";
/// Selects what the demonstration's two programs need, and no more.
const LEAST: &str = "--package=sim --package=virtual-board --no-default-features";

pub struct Program {
    pub package: &'static str,
    pub name: &'static str,
    /// Packages and features that are selected with it.
    pub with: &'static str,
}

/// The demonstration on the native board, with nothing that it does not need.
pub const NATIVE_DEMO: Program = Program { package: "sim", name: "demo", with: LEAST };
/// The native core behind a port.
pub const SERVE: Program = Program { package: "serve", name: "serve", with: SHARED };
/// The emulated board without scenes.
pub const BOARD: Program = Program { package: "virtual-board", name: "virtual-board", with: LEAST };
/// The emulated board with all that it can.
pub const SCENE_BOARD: Program = Program { with: SHARED, ..BOARD };

impl Program {
    pub const fn tool(name: &'static str) -> Self {
        Self { package: "host-tests", name, with: SHARED }
    }

    pub const fn sim(name: &'static str) -> Self {
        Self { package: "sim", name, with: SHARED }
    }

    /// Builds it, and returns the command that starts it.
    pub fn build(&self) -> Result<Command> {
        let mut command = cargo("build", self.package);
        command.args(["--bin", self.name]).args(self.with.split(' '));
        console::prepare(&mut command)?;
        Ok(Command::new(target().join(PROGRAMS).join(self.name)))
    }
}

/// Builds one of the tools of `host-tests` and runs it.
pub fn run_tool(name: &'static str, words: &[impl AsRef<OsStr>]) -> Result<()> {
    console::run(Program::tool(name).build()?.args(words))
}

/// `cargo <subcommand>` for a package of this machine. The emulator's crate asks for a newer compiler than it needs.
pub fn cargo(subcommand: &str, package: &str) -> Command {
    let mut command = console::cargo(subcommand);
    command.args(["--package", package, "--ignore-rust-version"]);
    command
}

/// Builds one of the examples, and returns the command that starts it.
pub fn example(name: &str) -> Result<Command> {
    let mut build = cargo("build", "host-tests");
    console::prepare(build.arg("--package=sim").args(SHARED.split(' ')).args(["--example", name]))?;
    Ok(Command::new(target().join(PROGRAMS).join("examples").join(name)))
}

/// Builds tests, selected by these words, and returns the command that runs them.
pub fn tests(words: &[&str]) -> Command {
    let mut command = console::cargo("test");
    // For a test that asks all programs for their help: built in another way, they would be compiled again.
    command.arg(QUIET).args(TESTS.split(' ')).args(words).env("FINGERTIP_TESTS", TESTS);
    command
}

/// Builds the tests of a command of [`tests`], then runs them.
pub fn test(command: &mut Command) -> Result<()> {
    let mut build = Command::new(command.get_program());
    // What follows `--` is for the tests.
    let words = command.get_args().take_while(|word| *word != "--");
    build.args(words.filter(|word| *word != "--no-fail-fast" && *word != QUIET));
    build.arg("--no-run");
    console::prepare(&mut build)?;
    console::run(command)
}

/// The repository's root, wherever it lies now: as cargo says, or else around the folder that the user is in.
pub fn root() -> &'static Path {
    static ROOT: OnceLock<PathBuf> = OnceLock::new();
    ROOT.get_or_init(|| {
        let package = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
        let here = env::current_dir().unwrap_or_default();
        let around = here.ancestors().find(|folder| folder.join("xtask").join("Cargo.toml").is_file());
        let root = package.as_deref().and_then(Path::parent).or(around);
        root.unwrap_or(Path::new(".")).to_path_buf()
    })
}

/// Cargo's build folder; everything that the commands write or install lies in it.
pub fn target() -> PathBuf {
    let named = env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    // The commands run in the root; the user may be elsewhere.
    named.and_then(|folder| std::path::absolute(folder).ok()).unwrap_or_else(|| root().join("target"))
}

/// A folder of that name in the build folder, made where it is not there; as the system calls it.
pub fn made(name: &str) -> Result<PathBuf> {
    let folder = target().join(name);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", shown(&folder)))?;
    fs::canonicalize(&folder).with_context(|| shown(&folder))
}

/// Empties a folder, or makes it.
pub fn emptied(folder: &Path) -> Result<()> {
    if folder.is_dir() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot empty {}", shown(folder)))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", shown(folder)))
}

pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", shown(path)))
}

/// Gives a program the paths of files to write or read, by their flags. The user may be elsewhere than the program.
pub fn give_files<const N: usize>(command: &mut Command, files: [(&str, &Option<PathBuf>); N]) -> Result<()> {
    for (flag, path) in files {
        if let Some(path) = path {
            command.arg(flag).arg(std::path::absolute(path).with_context(|| shown(path))?);
        }
    }
    Ok(())
}

/// A path as the user would type it: relative to the root where it lies below.
pub fn shown(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}

pub fn find_program(name: &str) -> Option<PathBuf> {
    env::split_paths(&env::var_os("PATH")?).map(|folder| folder.join(name)).find(|path| path.is_file())
}
