//! Hands the linker the firmware's memory, for images on the bare-metal target only: with twice the stack, because what
//! the firmware has in statics lies there.

use std::{env, error::Error, fs, path::PathBuf};

const MEMORY: &str = "../../memory.x";
/// The firmware's line, and that of an image.
const LINES: [(&str, &str); 2] = [
    ("STACK : ORIGIN = 0x20000000, LENGTH = 48K", "STACK : ORIGIN = 0x20000000, LENGTH = 96K"),
    ("RAM   : ORIGIN = 0x2000C000, LENGTH = 80K", "RAM   : ORIGIN = 0x20018000, LENGTH = 32K"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={MEMORY}");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    let mut memory = fs::read_to_string(MEMORY)?;
    for (firmware, image) in LINES {
        if !memory.contains(firmware) {
            return Err(format!("{MEMORY} has no line `{firmware}`").into());
        }
        memory = memory.replace(firmware, image);
    }
    fs::write(out.join("memory.x"), memory)?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    Ok(())
}
