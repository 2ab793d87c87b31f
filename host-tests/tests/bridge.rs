//! What the bridge is told by each mode, and by a look at a frame that is still being scanned.

use fingertip::config::newtons;
use fingertip::pipeline::{Bridge, Status};
use fingertip::shipped::Frame;
use fingertip::state::{Fault, Mode};
use fingertip::units::Duty;
use sim::native::bench::Bench;

/// Holds 1 N, with the duty that this takes.
fn holding() -> Bench {
    let mut board = Bench::default();
    board.tare();
    board.command().goal = newtons(1_000);
    for _ in 0..5_000 {
        board.step();
    }
    let status = board.step();
    assert!(status.mode == Mode::Force && status.duty.0 > 0, "{status:?}");
    board
}

/// With so many dead taxels.
fn dead(frame: &Frame, count: usize) -> Frame {
    let mut frame = *frame;
    (0..count).for_each(|place| frame.set_code(place, place, 0));
    frame
}

#[test]
fn a_sound_frame_changes_nothing() {
    let mut board = holding();
    let before = *board.status();
    let allowed = board.pipeline().config().params.bad_taxels_max as usize;
    for frame in [*board.frame(), dead(board.frame(), allowed)] {
        assert!(!board.pipeline().check_part(&frame));
        assert_eq!(*board.status(), before);
    }
}

#[test]
fn a_broken_frame_shorts_the_motor_and_leaves_the_verdict_to_the_step() {
    let mut board = holding();
    let before = *board.status();
    let broken = board.pipeline().config().params.bad_taxels_max as usize + 1;
    let frame = dead(board.frame(), broken);
    assert!(board.pipeline().check_part(&frame));
    let after = *board.status();
    assert_eq!((after.mode, after.fault, after.duty.0), (Mode::Force, None, 0));
    assert!(before.duty.0 > 0);
}

#[test]
fn nothing_is_looked_at_while_the_bridge_is_off() {
    let mut board = holding();
    board.command().torque = false;
    assert_eq!(board.step().mode, Mode::Off);
    let frame = dead(board.frame(), 10);
    assert!(!board.pipeline().check_part(&frame));
}

/// A fault brakes, that of the bridge itself puts it to sleep; off and tare let the motor coast.
#[test]
fn each_mode_tells_the_bridge_what_to_do() {
    let told = |mode, fault| Status { mode, fault, duty: Duty(-77), ..Status::default() }.bridge();
    for mode in [Mode::Off, Mode::Tare] {
        assert_eq!(told(mode, None), Bridge::Open, "{mode:?}");
    }
    for mode in [Mode::Approach, Mode::Force, Mode::Release, Mode::Identify] {
        assert_eq!(told(mode, None), Bridge::Driven(Duty(-77)), "{mode:?}");
    }
    assert_eq!(told(Mode::Fault, Some(Fault::Bridge)), Bridge::Asleep);
    for fault in [Fault::LostFrames, Fault::OverForce, Fault::SupplyLow, Fault::Crash] {
        assert_eq!(told(Mode::Fault, Some(fault)), Bridge::Brakes, "{fault:?}");
    }
}
