//! The image of `cargo xtask bringup` on the emulated board: what that can show passes, and all else is told.
//!
//! `FINGERTIP_BRINGUP` names the image; `cargo xtask test` builds it and sets it.

use bringup::judge::{Board, Verdict};
use std::collections::HashMap;
use std::path::PathBuf;
use virtual_board::{Options, bringup as emulated};

/// Figures of the emulated board that show nothing of a real one.
const NOT_SHOWN: [&str; 10] = [
    "hse_mhz",
    "lsi_khz",
    "flash_word_us",
    "flash_erase_ms",
    "noise_prefetch_codes",
    "noise_by_prefetch_codes",
    "loop_answer_us",
    "step_cycles",
    "step_most_cycles",
    "finger_most_cycles",
];

#[test]
fn what_the_emulated_board_can_show_passes() {
    let image: PathBuf = std::env::var_os("FINGERTIP_BRINGUP")
        .expect("FINGERTIP_BRINGUP must name the image: run `cargo xtask test`, which builds it and sets it")
        .into();
    let told = &mut |said: &str| println!("{said}");
    let options = Options::default();
    let (judgement, mut rig) = emulated::run(&image, &options, 200, &HashMap::new(), told).expect("it reports");
    println!("{}", judgement.text());
    assert_eq!((judgement.board, judgement.failed), (Board::Emulated, 0));
    let unshown = judgement.checks.iter().filter(|check| check.verdict == Verdict::NotShown);
    assert_eq!(unshown.map(|check| check.name.as_str()).collect::<Vec<_>>(), NOT_SHOWN);
    assert_eq!(judgement.passed, judgement.checks.len() - NOT_SHOWN.len());
    // The study's variants that are of one build, each.
    assert!(judgement.kernels.len() > 100, "{} kernels", judgement.kernels.len());
    assert!(judgement.kernels.iter().all(|kernel| kernel.median_cycles > 0.0 && kernel.verdict == Verdict::NotShown));
    // One on the host's word, then a watchdog each and the stack's foot.
    let resets = rig.resets().expect("it runs");
    let causes: Vec<_> = resets.iter().map(|reset| reset.cause.as_str()).collect();
    assert_eq!(causes, ["software", "WWDG", "IWDG", "software"]);
}
