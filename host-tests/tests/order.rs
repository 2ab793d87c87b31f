//! The core reads from top to bottom: no stage uses one that comes after it in `src/lib.rs`.

use std::path::Path;
use std::{fs, iter};

/// The files of a module: its own, and those of its folder.
fn files(core: &Path, stage: &str) -> Vec<(String, String)> {
    let mut folders = vec![core.join(stage)];
    let mut paths = vec![core.join(stage).with_extension("rs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("a folder's entry").path()) {
            if entry.is_dir() { folders.push(entry) } else { paths.push(entry) }
        }
    }
    let text = |path: &Path| fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    paths.iter().map(|path| (path.display().to_string(), text(path))).collect()
}

/// Modules of the core that a text names, comments aside.
fn named(text: &str) -> impl Iterator<Item = &str> {
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| line.split("crate::").skip(1))
        .filter_map(|rest| rest.split(|sign: char| !sign.is_alphanumeric() && sign != '_').next())
}

#[test]
fn no_stage_uses_a_later_one() {
    let core = Path::new(env!("CARGO_MANIFEST_DIR")).join("../src");
    let whole = fs::read_to_string(core.join("lib.rs")).expect("the core");
    let stages: Vec<_> = whole.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    let mut seen = 0;
    for (place, stage) in stages.iter().enumerate() {
        for (file, text) in files(&core, stage) {
            for other in named(&text) {
                let before = stages[..place].iter().chain(iter::once(stage)).any(|known| *known == other);
                let unknown = !stages.contains(&other);
                assert!(before || unknown, "{file} uses {other}, which comes after {stage}");
                seen += usize::from(before);
            }
        }
    }
    assert!(stages.len() > 15 && seen > 150, "{} stages, {seen} uses", stages.len());
}
