//! The core reads from top to bottom: no stage uses one that comes after it in `src/lib.rs`.

use crate::pages::files;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn core() -> PathBuf {
    Path::new(env!("FINGERTIP_ROOT")).join("src")
}

/// Names of the stages, modules of the core, in their order.
fn stages() -> Vec<String> {
    let whole = fs::read_to_string(core().join("lib.rs")).expect("the core's list");
    whole.lines().filter_map(|line| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned())).collect()
}

/// Names that a stage's own file and those of its folder have behind a prefix, except its own; each with a file.
fn uses(stage: &str, prefix: &str) -> Vec<(String, PathBuf)> {
    let folder = core().join(stage);
    let mut sources = vec![folder.with_extension("rs")];
    sources.retain(|file| file.is_file());
    if folder.is_dir() {
        files(&folder, &[".rs"], &mut sources);
    }
    let mut found = Vec::new();
    for file in sources {
        let text = fs::read_to_string(&file).expect("a source");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let named: BTreeSet<_> = code.flat_map(|line| line.split(prefix).skip(1)).map(word).collect();
        found.extend(named.into_iter().filter(|name| *name != stage).map(|name| (name.to_owned(), file.clone())));
    }
    found
}

fn word(text: &str) -> &str {
    text.split(|sign: char| !sign.is_alphanumeric() && sign != '_').next().unwrap_or_default()
}

#[test]
fn no_stage_uses_a_later_one_or_the_board() {
    let stages = stages();
    let mut seen = 0;
    for (own, stage) in stages.iter().enumerate() {
        for (other, file) in uses(stage, "crate::") {
            assert_ne!(other, "board", "{}", file.display());
            let Some(place) = stages.iter().position(|name| *name == other) else { continue };
            assert!(place < own, "{} uses {other}, which comes after {stage}", file.display());
            seen += 1;
        }
    }
    assert!(stages.len() > 15 && seen > 150, "{} stages, {seen} uses", stages.len());
    assert!(uses("board", "fingertip::").iter().any(|(name, _)| name == "pipeline"), "the board uses the core");
}
