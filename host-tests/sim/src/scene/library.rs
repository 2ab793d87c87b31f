//! The scenes that come with the project, and where a scene is found.

use super::error::alike;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Where the library lies.
pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/scenes")
}

/// The library's scenes by name, in order.
pub fn names() -> io::Result<Vec<String>> {
    names_in(&folder())
}

/// The names of a folder's TOML files, in order.
fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            names.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
        }
    }
    names.sort();
    Ok(names)
}

/// The path and the text of a scene, by its path or by its name in the library.
pub fn text(scene: &str) -> Result<(PathBuf, String), String> {
    find(&folder(), "scene", scene)
}

/// The path and the text of a file, by its path or by its name in a folder; `what` it is, errors tell.
pub fn find(folder: &Path, what: &str, name: &str) -> Result<(PathBuf, String), String> {
    let named = folder.join(name).with_extension("toml");
    let path = if Path::new(name).is_file() || !named.is_file() { PathBuf::from(name) } else { named };
    let text = fs::read_to_string(&path).map_err(|error| unknown(folder, what, name, &error))?;
    Ok((path, text))
}

/// Why there is no such file, and which there are in the folder.
pub fn unknown(folder: &Path, what: &str, name: &str, error: &io::Error) -> String {
    let names = names_in(folder).unwrap_or_default();
    let meant = alike(name, names.iter().map(String::as_str));
    let meant = meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"));
    format!("no {what} {name}: {error}{meant}\n  those that come with the project: {}", names.join(", "))
}
