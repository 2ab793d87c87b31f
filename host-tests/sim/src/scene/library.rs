//! The scenes that come with the project, and where a scene is found.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Where the library lies.
pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/scenes")
}

/// The library's scenes by name, in order.
///
/// # Errors
/// The folder cannot be read.
pub fn names() -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder())? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    Ok(names)
}

/// The path and the text of a scene, by its path or by its name in the library.
///
/// # Errors
/// There is none.
pub fn text(scene: &str) -> Result<(PathBuf, String), String> {
    let named = folder().join(scene).with_extension("toml");
    let path = if Path::new(scene).is_file() || !named.is_file() { PathBuf::from(scene) } else { named };
    match fs::read_to_string(&path) {
        Ok(text) => Ok((path, text)),
        Err(error) => {
            let names = names().unwrap_or_default();
            let words = names.iter().map(String::as_str);
            let meant =
                super::error::alike(scene, words).map_or(String::new(), |name| format!("; did you mean `{name}`?"));
            Err(format!("no scene {scene}: {error}{meant}\n  in the library: {}", names.join(", ")))
        }
    }
}
