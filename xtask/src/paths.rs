//! Paths.

use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::{env, fs};

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

/// A path as the user would type it: relative to the root where it lies below.
pub fn shown(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}

/// Looks a program up in `PATH`.
pub fn find_program(name: &str) -> Option<PathBuf> {
    env::split_paths(&env::var_os("PATH")?).map(|folder| folder.join(name)).find(|path| path.is_file())
}
