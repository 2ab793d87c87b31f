//! Commands to the bridge in each mode, and in the middle of the scan of a frame.

use crate::common::*;
use fingertip::pipeline::Bridge;

/// Ends of a grip.
type End = fn(&mut Bench);

/// Frame with the given number of dead taxels.
fn dead(frame: &Frame, count: usize) -> Frame {
    let mut frame = *frame;
    (0..count).for_each(|place| frame.set_code(place, place, 0));
    frame
}

#[test]
fn a_sound_frame_changes_nothing() {
    let mut board = holding(1_000);
    let before = *board.status();
    let allowed = board.pipeline().config().params.bad_taxels_max as usize;
    for frame in [*board.frame(), dead(board.frame(), allowed)] {
        assert!(!board.pipeline().check_part(&frame));
        assert_eq!(*board.status(), before);
    }
}

#[test]
fn a_broken_frame_shorts_the_motor_and_leaves_the_verdict_to_the_step() {
    let mut board = holding(1_000);
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
    let mut board = holding(1_000);
    board.command().torque = false;
    assert_eq!(board.step().mode, Mode::Off);
    let frame = dead(board.frame(), 10);
    assert!(!board.pipeline().check_part(&frame));
}

/// A fault brakes, that of the bridge itself puts it to sleep; off and tare brake while the tip moves, and open then.
#[test]
fn each_mode_has_its_command_for_the_bridge() {
    let bridge = |mode, fault, braking| Status { mode, fault, braking, duty: Duty(-77), ..Status::default() }.bridge();
    for (braking, expected) in [(false, Bridge::Open), (true, Bridge::Brakes)] {
        for mode in [Mode::Off, Mode::Tare] {
            assert_eq!(bridge(mode, None, braking), expected, "{mode:?}");
        }
        for mode in [Mode::Approach, Mode::Force, Mode::Release, Mode::Press, Mode::Strokes] {
            assert_eq!(bridge(mode, None, braking), Bridge::Driven(Duty(-77)), "{mode:?}");
        }
        assert_eq!(bridge(Mode::Fault, Some(Fault::Bridge), braking), Bridge::Asleep);
        for fault in [Fault::LostFrames, Fault::OverForce, Fault::SupplyLow, Fault::Crash] {
            assert_eq!(bridge(Mode::Fault, Some(fault), braking), Bridge::Brakes, "{fault:?}");
        }
    }
}

/// However a drive ends, the motor is shorted until the tip was at rest for 20 ms. Then the bridge opens for good.
#[test]
fn a_motor_that_was_driven_brakes_until_the_tip_rests() {
    let endings: [(&str, End); 4] = [
        ("torque off", |board| board.command().torque = false),
        ("tare", |board| (board.command().torque, board.command().tare_request) = (false, 77)),
        ("parameters", |board| {
            let config = board.pipeline().config().clone();
            board.command().torque = false;
            board.pipeline().configure(&config);
        }),
        ("fault", |board| {
            board.pipeline().stop(Fault::LostFrames);
            board.command().torque = false;
            assert_eq!(board.step().bridge(), Bridge::Brakes);
            board.command().clear_request += 1;
        }),
    ];
    for (name, end) in endings {
        let mut board = holding(1_000);
        end(&mut board);
        let mut travel_mm = vec![board.truth().travel_mm];
        while board.step().bridge() == Bridge::Brakes {
            assert!(!drives(board.status().mode), "{name}: {:?}", board.status().mode);
            travel_mm.push(board.truth().travel_mm);
            assert!(travel_mm.len() < 20_000, "{name}: it brakes for 2 s");
        }
        let count_mm: f64 = board.pipeline().config().count.0.to_num();
        let moved_mm = |frames: usize| {
            let last = &travel_mm[travel_mm.len().saturating_sub(frames)..];
            let [least, most] = [f64::min, f64::max].map(|of| last.iter().copied().reduce(of).unwrap());
            most - least
        };
        let (before_mm, rest_mm) = (moved_mm(225), moved_mm(195));
        assert!(rest_mm <= 2.0 * (0.005 + count_mm), "{name}: {rest_mm} mm within 20 ms of its rest");
        assert!(before_mm > 0.005, "{name}: it rested sooner, {before_mm} mm");
        // A tip that flies back moves by millimetres.
        let rest_mm = board.truth().travel_mm;
        assert!((5.8..6.14).contains(&rest_mm), "{name}: {rest_mm} mm");
        for _ in 0..1_000 {
            assert_eq!(board.step().bridge(), Bridge::Open, "{name}");
        }
        let moved_mm = (board.truth().travel_mm - rest_mm).abs();
        assert!(moved_mm < 0.1, "{name}: {moved_mm} mm with the bridge open");
    }
}

#[test]
fn a_stop_and_new_parameters_brake_at_once() {
    let mut board = holding(1_000);
    let config = board.pipeline().config().clone();
    board.pipeline().configure(&config);
    assert_eq!((board.status().mode, board.status().bridge()), (Mode::Off, Bridge::Brakes));
    let mut board = holding(1_000);
    board.pipeline().stop(Fault::LostFrames);
    assert_eq!((board.status().mode, board.status().bridge()), (Mode::Fault, Bridge::Brakes));
}
