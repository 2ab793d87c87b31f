//! The packages that others take: made, and tried from a project that is none of this workspace.

use crate::{
    console::{self, Console},
    paths,
};
use anyhow::{Context, Result};
use std::fs;

/// What others may depend on; the later depends on the earlier.
pub const PACKAGES: [&str; 2] = ["fingertip-lanes", "fingertip"];
/// Its version, as in the workspace's manifest.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Makes the packages and runs the tests of `host-tests/outside`, which depends on them.
pub fn run(console: &mut Console) -> Result<()> {
    let mut package = console::cargo("package");
    // The project outside compiles them.
    package.args(["--allow-dirty", "--no-verify"]).args(PACKAGES.iter().flat_map(|name| ["--package", name]));
    console.run(&mut package)?;
    let made = paths::target().join("package");
    let unpacked = paths::target().join("outside").join("packages");
    if unpacked.is_dir() {
        fs::remove_dir_all(&unpacked).with_context(|| format!("cannot empty {}", paths::shown(&unpacked)))?;
    }
    fs::create_dir_all(&unpacked).with_context(|| format!("cannot make {}", paths::shown(&unpacked)))?;
    let mut test = console::cargo("test");
    for name in PACKAGES {
        let folder = format!("{name}-{VERSION}");
        let mut unpack = std::process::Command::new("tar");
        // Their times are those of now: cargo goes by them.
        unpack.args(["-x", "-z", "-m", "-f"]).arg(made.join(format!("{folder}.crate"))).arg("-C").arg(&unpacked);
        console.run(&mut unpack)?;
        test.arg("--config").arg(format!("patch.crates-io.{name}.path={:?}", unpacked.join(folder)));
    }
    let outside = paths::root().join("host-tests").join("outside");
    // The same versions of all else, so that it works offline.
    let lock = outside.join("Cargo.lock");
    fs::copy(paths::root().join("Cargo.lock"), &lock)
        .with_context(|| format!("cannot write {}", paths::shown(&lock)))?;
    test.arg("--manifest-path")
        .arg(outside.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(paths::target().join("outside"));
    console.run(&mut test)
}
