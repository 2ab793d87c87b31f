//! Which stage of the core uses which, read from its sources.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A stage of the core: a module that `src/lib.rs` names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// What it uses, and a file that does.
    pub uses: Vec<(String, PathBuf)>,
}

/// The stages in their order, the first one first; what they use is a stage or another crate of this workspace.
///
/// # Errors
/// A source cannot be read.
pub fn stages(core: &Path) -> io::Result<Vec<Stage>> {
    let whole = fs::read_to_string(core.join("lib.rs"))?;
    let names: Vec<_> = whole.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    names.iter().map(|name| Ok(Stage { name: (*name).into(), uses: uses(core, name, "crate::")? })).collect()
}

/// What the board's side of the image uses of the core.
///
/// # Errors
/// A source cannot be read.
pub fn board(core: &Path) -> io::Result<Stage> {
    let mut uses = uses(core, "main", "fingertip::")?;
    uses.extend(self::uses(core, "board", "fingertip::")?);
    Ok(Stage { name: "board".into(), uses })
}

/// What the files of a stage name behind a prefix, itself aside.
fn uses(core: &Path, stage: &str, prefix: &str) -> io::Result<Vec<(String, PathBuf)>> {
    let mut found = Vec::new();
    for file in files(core, stage)? {
        let text = fs::read_to_string(&file)?;
        let code: Vec<_> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let named: BTreeSet<_> = code.iter().flat_map(|line| line.split(prefix).skip(1)).map(word).collect();
        found.extend(named.into_iter().filter(|name| *name != stage).map(|name| (name.into(), file.clone())));
        if code.iter().any(|line| line.contains("lanes::")) {
            found.push(("lanes".into(), file));
        }
    }
    Ok(found)
}

/// A stage's own file, and those of its folder.
fn files(core: &Path, stage: &str) -> io::Result<Vec<PathBuf>> {
    let mut found: Vec<_> = [core.join(stage).with_extension("rs")].into_iter().filter(|file| file.is_file()).collect();
    let mut folders = vec![core.join(stage)];
    while let Some(folder) = folders.pop() {
        if !folder.is_dir() {
            continue;
        }
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() { folders.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    Ok(found)
}

fn word(text: &str) -> &str {
    text.split(|sign: char| !sign.is_alphanumeric() && sign != '_').next().unwrap_or_default()
}
