//! The loop closed at chosen frame rates, with one converter and with two.

use super::Finger;
use crate::common::*;

/// Holds 1 N and 2 N at a wall. Returns the largest force above the goal and the largest error at rest, N.
fn held<const ROWS: usize, const COLUMNS: usize>(pitch_um: i32, frames_per_s: u32, converters: u32) -> [f64; 2] {
    let clocks = Clocks { converters, frame_ns: Some(1_000_000_000 / frames_per_s), ..CLOCKS };
    let mut finger = Finger::<ROWS, COLUMNS>::with_clocks(pitch_um, [0.0, 0.0], FitLevel::AllRows, &clocks);
    finger.start();
    let (mut over, mut off) = (0.0_f64, 0.0_f64);
    for (goal_mn, goal) in [(1_000, 1.0), (2_000, 2.0)] {
        finger.command.goal = newtons(goal_mn);
        for _ in 0..frames_per_s * 3 / 2 {
            finger.step();
            over = over.max(finger.force_n() - goal);
        }
        let ([least, most], _) = finger.hold(goal_mn, 0.1);
        off = off.max(most - goal).max(goal - least);
    }
    println!("{ROWS} x {COLUMNS} at {frames_per_s} Hz, {converters} converters: {over:.3} N over, {off:.4} N off");
    [over, off]
}

/// A population's promise: no force is more than 150 mN above the goal, and 300 mN for each N of it.
const OVER_N: f64 = 0.45;

#[test]
fn a_force_is_held_at_every_rate() {
    for frames_per_s in [100, 200, 500, 1_000, 2_000, 5_000, 10_000] {
        let mut runs = vec![held::<6, 4>(2_000, frames_per_s, 2), held::<10, 10>(1_500, frames_per_s, 2)];
        if frames_per_s <= 1_000 {
            runs.push(held::<16, 32>(900, frames_per_s, 1));
        }
        for [over, off] in runs {
            assert!(off < 0.01, "{off} N off at {frames_per_s} Hz");
            assert!(over < OVER_N, "{over} N over at {frames_per_s} Hz");
        }
    }
}

/// Steps of a driven finger whose frames are new, repeated once, or repeated for ever.
#[test]
fn a_frame_that_comes_again_is_not_new() {
    let mut finger = Finger::<6, 4>::new(2_000, [0.0, 0.0], FitLevel::AllRows);
    finger.start();
    finger.run(0.1);
    let missed = finger.pipeline.status().missed_frames;
    let status = finger.repeat();
    assert_eq!((status.fault, status.missed_frames), (None, missed));
    assert!(status.limits.has(Limits::FRAME_MISSED));
    assert!(!finger.step().limits.has(Limits::FRAME_MISSED));
    let twice = [finger.repeat(), finger.repeat()].map(|status| (status.fault, status.missed_frames));
    assert_eq!(twice, [(None, missed), (Some(Fault::LostFrames), missed)]);
}
