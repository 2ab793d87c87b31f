//! Hands the linker the memory of the board that QEMU emulates for the core.

use std::{env, error::Error, fs, path::PathBuf};

/// The beginning of a target's name, then start and KB of its board's flash and RAM. The RISC-V board has RAM only; the
/// first half serves as its flash.
const BOARDS: [(&str, [u32; 4]); 6] = [
    ("thumbv6m", [0, 256, 0x2000_0000, 16]),                          // microbit
    ("thumbv7m", [0, 4096, 0x2000_0000, 4096]),                       // mps2-an385
    ("thumbv7em-none-eabihf", [0x0800_0000, 1024, 0x2000_0000, 128]), // netduinoplus2
    ("thumbv7em-none-eabi", [0, 4096, 0x2000_0000, 4096]),            // mps2-an386
    ("thumbv8m.main", [0x1000_0000, 4096, 0x3800_0000, 4096]),        // mps2-an505, its secure addresses
    ("riscv32", [0x8000_0000, 1024, 0x8010_0000, 1024]),              // virt
];
/// Memory in which the linker script of `riscv-rt` places the program.
const RISCV_REGIONS: [(&str, &str); 6] =
    [("TEXT", "FLASH"), ("RODATA", "FLASH"), ("DATA", "RAM"), ("BSS", "RAM"), ("HEAP", "RAM"), ("STACK", "RAM")];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let target = env::var("TARGET")?;
    let board = BOARDS.iter().find(|(name, _)| target.starts_with(name));
    let (_, [flash, flash_kb, ram, ram_kb]) = board.ok_or("no emulated board has this core")?;
    let mut memory = format!(
        "MEMORY {{\n  FLASH (rx) : ORIGIN = {flash:#x}, LENGTH = {flash_kb}K\n  RAM (rwx) : ORIGIN = {ram:#x}, LENGTH = {ram_kb}K\n}}\n"
    );
    if target.starts_with("riscv") {
        memory.extend(RISCV_REGIONS.map(|(what, of)| format!("REGION_ALIAS(\"REGION_{what}\", {of});\n")));
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    fs::write(out.join("memory.x"), memory)?;
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}
