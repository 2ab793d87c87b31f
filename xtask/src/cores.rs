//! The closed loop of the crate's example on every core that QEMU emulates: each gives the same bits as this machine.

use crate::console;
use crate::host::{self, Program};
use crate::image::{self, Image};
use crate::toolchain::{self, TARGET};
use crate::{docs, install};
use anyhow::{Context, Result, ensure};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// The page with the table of cores, and the example that runs the images and prints it.
pub const PAGE: (&str, &str) = ("docs/porting.md", "porting-page");
/// The folder of the loop that every core runs.
pub const LOOP: &str = "host-tests/cores";
/// The folder of the example for another board, and its target.
pub const EXAMPLE: &str = "examples/rp2040";
pub const TARGET_OF_EXAMPLE: &str = "thumbv6m-none-eabi";
const RISCV_PROGRAM: &str = "qemu-system-riscv32";

/// Core, rows and columns of the array, the compiler's target and flags for it, and QEMU's board.
type Core = (&'static str, &'static str, &'static str, &'static [&'static str], &'static str);

const CORES: [Core; 11] = [
    ("Cortex-M0", "6x4", "thumbv6m-none-eabi", &[], "microbit"),
    ("Cortex-M3", "6x4", "thumbv7m-none-eabi", &[], "mps2-an385"),
    ("Cortex-M4", "6x4", "thumbv7em-none-eabi", &[], "mps2-an386"),
    ("Cortex-M4F", "6x4", TARGET, &[], "netduinoplus2"),
    ("Cortex-M33", "6x4", "thumbv8m.main-none-eabi", &[], "mps2-an505"),
    ("Cortex-M33F", "6x4", "thumbv8m.main-none-eabihf", &[], "mps2-an505"),
    ("Cortex-M33F", "6x4", "thumbv8m.main-none-eabihf", &["-Ctarget-cpu=cortex-m33"], "mps2-an505"),
    ("Cortex-M4F", "10x10", TARGET, &["--cfg=array=\"10x10\""], "netduinoplus2"),
    ("Cortex-M4F", "16x16", TARGET, &["--cfg=array=\"16x16\""], "netduinoplus2"),
    ("RV32IMC", "6x4", "riscv32imc-unknown-none-elf", &[], "virt"),
    ("RV32IMAC", "6x4", "riscv32imac-unknown-none-elf", &[], "virt"),
];

/// The emulator and its options. On Arm an instruction takes 64 ns, a tick of SysTick on the slowest board.
fn emulator(target: &str, board: &str) -> String {
    if target.starts_with("riscv") {
        format!("{RISCV_PROGRAM} -M {board} -bios none -icount shift=0,align=off,sleep=off")
    } else {
        format!("qemu-system-arm -M {board} -icount shift=6,align=off,sleep=off")
    }
}

/// Runs the loop on every core and renews the page with the table.
pub fn run_all() -> Result<()> {
    docs::renew(PAGE.0, &page()?, false, &mut Vec::new())
}

/// Runs the image of every core and compares its digest with this machine's. Returns the page with the table.
pub fn page() -> Result<String> {
    ensure_m4()?;
    if host::find_program(RISCV_PROGRAM).is_none() {
        // Of the same version as the emulator for Arm: both share files.
        install::newest(&["qemu-system-riscv"], "running the loop on emulated cores")?;
    }
    let targets = CORES.map(|(_, _, target, ..)| target);
    toolchain::ensure_for(&targets, "the loop is built for other cores than the board's")?;
    let folder = host::made("cores")?;
    let mut list = String::new();
    for (number, (name, array, target, flags, board)) in CORES.iter().enumerate() {
        console::prepare(image::apart("build", LOOP, target, flags).arg("--release"))?;
        // Two boards have the same target and name.
        let elf = folder.join(format!("{number}.elf"));
        fs::copy(toolchain::images_for(target, flags).join("cores"), &elf).with_context(|| host::shown(&elf))?;
        let bytes = Image::read(&elf)?.bytes.len();
        let (flags, emulator) = (flags.join(" "), emulator(target, board));
        list += &format!("{name}\t{array}\t{target}\t{flags}\t{bytes}\t{emulator}\t{}\n", elf.display());
    }
    let file = folder.join("list.tsv");
    host::write(&file, list)?;
    console::output(host::example(PAGE.1)?.arg(&file))
}

/// Builds the example for another board, which links for its chip.
pub fn example() -> Result<()> {
    let target = TARGET_OF_EXAMPLE;
    toolchain::ensure_for(&[target], "the example for another board is built for it")?;
    let size = |features: &[&str]| {
        console::prepare(image::apart("build", EXAMPLE, target, &[]).arg("--release").args(features))?;
        Ok::<_, anyhow::Error>(Image::read(&toolchain::images_for(target, &[]).join("rp2040"))?.bytes.len())
    };
    let measures = size(&["--features", "fingertip/measure"])?;
    let bytes = size(&[])?;
    // Without the loop a few kilobytes would be left: its configuration would always be refused.
    ensure!(bytes > 40_000, "{EXAMPLE} has {bytes} bytes: the loop is not in it");
    // Without the feature the code of the motions must not be in the image.
    ensure!(measures > bytes + 7_000, "{EXAMPLE} has {bytes} bytes, and {measures} with the feature `measure`");
    console::print(&format!("{EXAMPLE}: {bytes} bytes of flash, {measures} with the motions that measure"));
    Ok(())
}

// The core on an emulated Cortex-M4F.

pub const M4_EMULATOR: &str = "qemu-system-arm";
/// The first version with the plugin interface of `m4-timing`.
const VERSION_MIN: u32 = 9;

/// Runs recorded stimulus, and random inputs of functions with own instructions, there and here, and compares.
pub fn run_m4() -> Result<()> {
    console::run(Program::tool("qemu-host").build()?.arg(prepare()?).arg(host::target().join("stimulus")))
}

pub fn test_m4() -> Result<()> {
    let image = prepare()?;
    host::test(host::tests(&["--test", "qemu", "--", "--ignored"]).env("FINGERTIP_QEMU_IMAGE", image))
}

/// Makes sure of an emulator that also takes the plugin of the estimated cycles.
pub fn ensure_m4() -> Result<()> {
    if version() >= Some(VERSION_MIN) {
        return Ok(());
    }
    let why = "running code on an emulated Cortex-M4F";
    install::newest(&[M4_EMULATOR], why)?;
    let found = version().map_or("none".into(), |version| version.to_string());
    let new = version() >= Some(VERSION_MIN);
    ensure!(new, "{why} needs {M4_EMULATOR} {VERSION_MIN} or newer; found {found} in PATH: install one by hand");
    Ok(())
}

fn version() -> Option<u32> {
    let output = Command::new(M4_EMULATOR).arg("--version").output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.strip_prefix("QEMU emulator version ")?.split('.').next()?.parse().ok()
}

fn prepare() -> Result<PathBuf> {
    ensure_m4()?;
    image::build("qemu", "qemu")
}
