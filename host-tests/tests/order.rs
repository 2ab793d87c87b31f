//! The core reads from top to bottom: no stage uses one that comes after it in `src/lib.rs`.

use host_tests::imports::{board, stages};
use std::path::Path;

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
