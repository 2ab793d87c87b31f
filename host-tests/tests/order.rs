//! The core reads from top to bottom: no stage uses one that comes after it in `src/lib.rs`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// A stage of the core: a module that `src/lib.rs` names.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stage {
    /// Its name.
    name: String,
    /// Stages that it uses, each with a file that uses it.
    uses: Vec<(String, PathBuf)>,
}

/// Stages in their order; each uses only stages or other crates of this workspace.
fn stages(core: &Path) -> io::Result<Vec<Stage>> {
    let whole = fs::read_to_string(core.join("lib.rs"))?;
    let names: Vec<_> = whole.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    names.iter().map(|name| Ok(Stage { name: (*name).into(), uses: uses(core, name, "crate::")? })).collect()
}

/// Stages of the core that the board's side of the image uses.
fn board(core: &Path) -> io::Result<Stage> {
    let mut uses = uses(core, "main", "fingertip::")?;
    uses.extend(self::uses(core, "board", "fingertip::")?);
    Ok(Stage { name: "board".into(), uses })
}

/// Names that the files of a stage have behind a prefix, except its own.
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

#[test]
fn no_stage_uses_a_later_one() {
    let stages = stages(&Path::new(env!("FINGERTIP_ROOT")).join("src")).expect("the core's sources");
    let place = |name: &str| stages.iter().position(|stage| stage.name == name);
    let mut seen = 0;
    for (own, stage) in stages.iter().enumerate() {
        for (other, file) in &stage.uses {
            let Some(other_place) = place(other) else { continue };
            assert!(other_place < own, "{} uses {other}, which comes after {}", file.display(), stage.name);
            seen += 1;
        }
    }
    assert!(stages.len() > 15 && seen > 150, "{} stages, {seen} uses", stages.len());
}

#[test]
fn the_board_uses_the_core_and_the_core_no_board() {
    let core = Path::new(env!("FINGERTIP_ROOT")).join("src");
    assert!(board(&core).expect("the board's sources").uses.iter().any(|(name, _)| name == "pipeline"));
    let stages = stages(&core).expect("the core's sources");
    assert!(stages.iter().all(|stage| stage.uses.iter().all(|(name, _)| name != "board")));
}
