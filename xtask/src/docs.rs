//! Generated files: written anew, or checked for being fresh.

use crate::{
    console::{self, Console},
    cores, figures, host, image,
    package::PACKAGES,
    paths,
    toolchain::Choice,
    tools,
};
use anyhow::{Context, Result, bail};
use std::{fs, path::Path};

/// Files that programs write: path, and the example that prints their text.
const GENERATED: &[(&str, &str)] = &[
    ("docs/control-table.md", "control-table"),
    ("docs/firmware.md", "firmware-page"),
    ("docs/scenes.md", "scenes-page"),
    ("docs/budget.md", "budget-page"),
    ("docs/board.md", "analogue"),
    ("docs/pictures/schematic.svg", "schematic"),
    ("examples/dynamixel/fingertip.model", "model-file"),
    ("examples/dynamixel/fingertip_direct.model", "model-file-direct"),
    ("python/fingertip/registers.py", "python-package"),
];
/// The demonstration's figures, as the README shows them.
const FIGURES: &str = "docs/demo.json";
/// Its pictures, and those of the paper.
pub const PICTURES: &str = "docs/pictures";
/// The paper's figures among the pictures.
const PAPER: [&str; 3] = ["docs/pictures/figure-7.svg", "docs/pictures/figure-10.svg", "docs/pictures/figure-11.svg"];
const README: (&str, &str) = ("README.md", "readme");

/// Flags of `cargo xtask docs`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  cargo xtask docs\n  cargo xtask docs --check")]
pub struct Args {
    /// Change nothing; fail where a generated file, or a figure of the README, is stale
    #[arg(long)]
    check: bool,
}

/// Writes or checks the generated files; the figures come from a run of the demonstration.
pub fn run(args: &Args, choice: Choice, console: &mut Console) -> Result<()> {
    let mut stale = Vec::new();
    for (path, example) in GENERATED {
        renew(path, &print(example, None)?, args.check, &mut stale, console)?;
    }
    renew(cores::PAGE.0, &cores::page(choice, console)?, args.check, &mut stale, console)?;
    for package in PACKAGES {
        let items = tools::public_items(package, console)?;
        renew(&format!("docs/api/{package}.txt"), &items, args.check, &mut stale, console)?;
    }
    let drawn = paths::target().join("docs").join("figures");
    figures::draw(&drawn, console)?;
    for path in PAPER {
        let file = drawn.join(Path::new(path).file_name().unwrap_or_default());
        let text = fs::read_to_string(&file).with_context(|| format!("cannot read {}", paths::shown(&file)))?;
        renew(path, &text, args.check, &mut stale, console)?;
    }

    let root = paths::root();
    let (json, pictures) = if args.check {
        (paths::target().join("docs").join("demo.json"), paths::target().join("docs").join("pictures"))
    } else {
        (root.join(FIGURES), root.join(PICTURES))
    };
    fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", paths::shown(&pictures)))?;
    let image = image::firmware(choice, console)?;
    let mut command = host::BOARD.build(console)?;
    command.args(["demo", "--image"]).arg(&image.elf).arg("--json").arg(&json).arg("--out").arg(&pictures);
    console.run(&mut command)?;
    renew(README.0, &print(README.1, Some(&json))?, args.check, &mut stale, console)?;

    if !stale.is_empty() {
        bail!("stale: {}; write them anew with `cargo xtask docs`", stale.join(", "));
    }
    Ok(())
}

/// The text that a program prints.
fn print(example: &str, argument: Option<&Path>) -> Result<String> {
    let mut command = console::cargo("run");
    command.args(["--quiet", "--example", example, "--"]).args(argument);
    console::output(&mut command)
}

/// Writes a file that is not fresh, or adds it to the stale ones.
pub fn renew(path: &str, text: &str, check: bool, stale: &mut Vec<String>, console: &Console) -> Result<()> {
    let file = paths::root().join(path);
    if fs::read_to_string(&file).is_ok_and(|present| present == text) {
        console.print(&format!("fresh    {path}"));
    } else if check {
        console.print(&format!("stale    {path}"));
        stale.push(path.into());
    } else {
        fs::write(&file, text).with_context(|| format!("cannot write {path}"))?;
        console.print(&format!("written  {path}"));
    }
    Ok(())
}
