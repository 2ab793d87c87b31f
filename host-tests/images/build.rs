//! Hands the linker the firmware's memory, for images on the bare-metal target only.

use std::{env, error::Error, fs, path::PathBuf};

const MEMORY: &str = "../../memory.x";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=../images/build.rs");
    println!("cargo:rerun-if-changed={MEMORY}");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    fs::copy(MEMORY, out.join("memory.x"))?;
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
