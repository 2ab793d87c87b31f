//! Scenes of the project, and where a scene is found.

use crate::scene::reader::did_you_mean;
use std::path::{Path, PathBuf};
use std::{fs, io};

pub fn folder() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("host-tests/sim/scenes")
}

/// Names of the scenes of the library, sorted.
pub fn names() -> io::Result<Vec<String>> {
    names_in(&folder())
}

/// Names of the TOML files of a folder, sorted.
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

/// Returns path and text of a scene, by its path or its name in the library.
pub fn text(scene: &str) -> Result<(PathBuf, String), String> {
    find(&folder(), "scene", scene)
}

/// Returns path and text of a file, by its path or its name in a folder. Errors call the file `what`.
pub fn find(folder: &Path, what: &str, name: &str) -> Result<(PathBuf, String), String> {
    let named = folder.join(name).with_extension("toml");
    let path = if Path::new(name).is_file() || !named.is_file() { PathBuf::from(name) } else { named };
    let text = fs::read_to_string(&path).map_err(|error| unknown(folder, what, name, &error))?;
    Ok((path, text))
}

/// Explains that there is no such file, and lists those of the folder.
pub fn unknown(folder: &Path, what: &str, name: &str, error: &io::Error) -> String {
    let names = names_in(folder).unwrap_or_default();
    let meant = did_you_mean(name, names.iter().map(String::as_str));
    format!("no {what} {name}: {error}{meant}\n  those that come with the project: {}", names.join(", "))
}
