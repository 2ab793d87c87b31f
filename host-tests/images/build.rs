//! Hands the linker the memory of the firmware's board, or of the emulated board of another core, for bare-metal targets
//! only.

use std::{env, error::Error, fs, path::PathBuf};

const MEMORY: &str = "../../src/board/memory.x";
/// Boards of QEMU for other cores than the firmware's: the beginning of the target's name, then start and KB of flash and
/// RAM. The RISC-V board has RAM only; the first half stands in for its flash.
const BOARDS: [(&str, [u32; 4]); 5] = [
    ("thumbv6m", [0, 256, 0x2000_0000, 16]),                   // microbit
    ("thumbv7m", [0, 4096, 0x2000_0000, 4096]),                // mps2-an385
    ("thumbv7em-none-eabi", [0, 4096, 0x2000_0000, 4096]),     // mps2-an386
    ("thumbv8m.main", [0x1000_0000, 4096, 0x3800_0000, 4096]), // mps2-an505, its secure addresses
    ("riscv32", [0x8000_0000, 1024, 0x8010_0000, 1024]),       // virt
];
/// The firmware's core.
const FIRMWARE: &str = "thumbv7em-none-eabihf";
/// Where the linker script of `riscv-rt` places what it links.
const RISCV_REGIONS: [(&str, &str); 6] =
    [("TEXT", "FLASH"), ("RODATA", "FLASH"), ("DATA", "RAM"), ("BSS", "RAM"), ("HEAP", "RAM"), ("STACK", "RAM")];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=../images/build.rs");
    println!("cargo:rerun-if-changed={MEMORY}");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let target = env::var("TARGET")?;
    let board = BOARDS.iter().find(|(name, _)| target != FIRMWARE && target.starts_with(name));
    let memory = match board {
        None => fs::read_to_string(MEMORY)?,
        Some((_, [flash, flash_kb, ram, ram_kb])) => {
            let mut text = format!(
                "MEMORY {{\n  FLASH (rx) : ORIGIN = {flash:#x}, LENGTH = {flash_kb}K\n  RAM (rwx) : ORIGIN = {ram:#x}, LENGTH = {ram_kb}K\n}}\n"
            );
            if target.starts_with("riscv") {
                text.extend(RISCV_REGIONS.map(|(what, of)| format!("REGION_ALIAS(\"REGION_{what}\", {of});\n")));
            }
            text
        }
    };
    fs::write(out.join("memory.x"), memory)?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // The image that checks a board logs as the firmware does.
    if env::var_os("CARGO_FEATURE_IMAGE").is_some() {
        println!("cargo:rustc-env=DEFMT_LOG=info");
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
