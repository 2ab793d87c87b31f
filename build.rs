//! Hands the linker its scripts, for the flash image only: who takes the core as a library has memory of their own.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory.x");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" || env::var_os("CARGO_FEATURE_FIRMWARE").is_none() {
        return Ok(());
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or("cargo sets OUT_DIR")?);
    fs::copy("memory.x", out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    // Sections follow each other without padding to a page: flash has no pages to protect.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Fixed log level: the image does not depend on the builder's environment.
    println!("cargo:rustc-env=DEFMT_LOG=info");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    Ok(())
}
