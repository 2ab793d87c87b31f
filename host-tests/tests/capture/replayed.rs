//! A replay from the parameters, the gains and the frames alone.

use super::burst::{Finger, gains};
use fingertip::capture::{Ended, State};
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::measure::Task;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{CLOCKS, COLUMNS, ROWS, TARE_FRAMES};
use fingertip::state::{Fault, Mode};
use replay::{Field, replay};

const BYTES: usize = 44 << 10;

fn agrees<const BYTES: usize>(finger: &Finger<BYTES>) -> u32 {
    let mut last = Status::default();
    let replayed = replay::<ROWS, COLUMNS>(finger.capture.data(), &CLOCKS, |_, status| last = *status);
    let replayed = replayed.expect("a capture");
    assert_eq!(replayed.difference, None);
    replayed.head.frames
}

#[test]
fn a_press_replays_to_the_bit_also_with_gains() {
    let finger = Finger::<BYTES>::pressed();
    let (mut modes, mut force_n) = (Vec::new(), 0.0);
    let replayed = replay::<ROWS, COLUMNS>(finger.capture.data(), &CLOCKS, |_, status| {
        if modes.last() != Some(&status.mode) {
            modes.push(status.mode);
        }
        force_n = status.contact.force.0.to_num::<f64>();
    });
    let replayed = replayed.expect("a capture");
    assert_eq!(replayed.difference, None);
    assert_eq!((replayed.head.ended, replayed.head.gains), (Ended::Full, gains()));
    assert_eq!(modes, [Mode::Tare, Mode::Off, Mode::Approach, Mode::Force], "a press is in it");
    assert!((force_n - 0.8).abs() < 0.1, "{force_n} N");
    assert!(replayed.head.frames > TARE_FRAMES + 600, "{} frames", replayed.head.frames);
}

#[test]
fn what_the_finger_did_before_does_not_matter() {
    let mut finger = Finger::<{ 8 << 10 }>::new();
    finger.native.tare();
    finger.native.command().goal = newtons(1_500);
    (0..3_000).for_each(|_| {
        finger.native.step();
    });
    finger.native.request(Task::Press);
    (0..3_000).for_each(|_| {
        finger.native.step();
    });
    finger.native.command().goal = newtons(0);
    (0..3_000).for_each(|_| {
        finger.native.step();
    });
    finger.native.step_with(|record| record.sense.bridge_fault = true);
    assert_eq!(finger.native.status().fault, Some(Fault::Bridge));
    *finger.native.command() = Command { torque: false, clear_request: 1, ..*finger.native.command() };
    (0..500).for_each(|_| {
        finger.native.step();
    });
    for _ in 0..2 {
        finger.press();
        agrees(&finger);
        *finger.native.command() = Command { torque: false, goal: newtons(0), ..*finger.native.command() };
        (0..300).for_each(|_| finger.frame());
    }
    assert_eq!(finger.capture.standing().count, 2);
}

/// What holds the current back must not forget because somebody wants a record.
#[test]
fn the_motor_stays_as_warm_as_it_is() {
    let mut finger = Finger::<BYTES>::new();
    finger.native.tare();
    *finger.native.command() = Command { torque: true, goal: newtons(6_000), ..*finger.native.command() };
    (0..5_000).for_each(|_| finger.frame());
    *finger.native.command() = Command { torque: false, goal: newtons(0), ..*finger.native.command() };
    (0..200).for_each(|_| finger.frame());
    let before: f64 = finger.native.status().winding.0.to_num();
    assert!(before > 88.5, "{before} C: it is warmer than after a reset");
    finger.press();
    let mut coldest = f64::MAX;
    let replayed = replay::<ROWS, COLUMNS>(finger.capture.data(), &CLOCKS, |_, status| {
        coldest = coldest.min(status.winding.0.to_num());
    });
    assert_eq!(replayed.expect("a capture").difference, None);
    assert!(coldest > before - 0.1, "{coldest} C after {before} C");
}

#[test]
fn a_fault_is_in_it_and_what_comes_after() {
    let mut finger = Finger::<BYTES>::new();
    finger.capture.arm();
    finger.native.command().tare_request += 1;
    (0..300).for_each(|_| finger.frame());
    finger.native.command().torque = true;
    finger.native.command().goal = newtons(500);
    (0..100).for_each(|_| finger.frame());
    (0..5).for_each(|_| finger.frame_with(|record| record.sense.supply_mv = 0));
    (0..20).for_each(|_| finger.frame());
    assert_eq!(finger.native.status().fault, Some(Fault::SupplyLow));
    finger.capture.end(Ended::Asked);
    assert_eq!(agrees(&finger), 425);
    // What acts on the loop between steps ends it; what is there replays.
    let mut finger = Finger::<BYTES>::new();
    finger.capture.arm();
    finger.native.command().tare_request += 1;
    (0..200).for_each(|_| finger.frame());
    finger.native.pipeline().stop(Fault::LostFrames);
    finger.capture.end(Ended::Stopped);
    (0..20).for_each(|_| finger.frame());
    assert_eq!(finger.capture.standing().state, State::Done);
    assert_eq!(agrees(&finger), 200);
}

#[test]
fn another_parameter_or_a_step_that_answers_otherwise_is_found_where_it_is() {
    let finger = Finger::<BYTES>::pressed();
    let mut bytes = finger.capture.data().to_vec();
    // A creep's share more, though its effect comes late.
    let place = Params::RANGES.iter().position(|(name, ..)| *name == "modulus_pa").expect("a parameter");
    bytes[72 + 4 * place] ^= 1;
    let replayed = replay::<ROWS, COLUMNS>(&bytes, &CLOCKS, |_, _| {}).expect("a capture");
    assert_eq!(replayed.difference.map(|difference| (difference.frame, difference.field)), Some((0, Field::Digest)));
    let told = replayed.difference.map(|difference| difference.to_string()).unwrap_or_default();
    assert!(told.contains("frame 0: digest captured") && told.contains("replayed"), "{told}");

    // A duty that is one more than the core's.
    let mut finger = Finger::<BYTES>::new();
    finger.capture.arm();
    finger.native.command().tare_request += 1;
    finger.native.command().fit_level = fingertip::contact::FitLevel::TwoRows;
    (0..20).for_each(|_| finger.frame());
    let mut status = *finger.native.status();
    status.duty.0 += 1;
    let given = finger.native.record();
    finger.capture.record(&given.frame, &given.sense, &given.command, &status);
    finger.capture.end(Ended::Asked);
    let replayed = replay::<ROWS, COLUMNS>(finger.capture.data(), &CLOCKS, |_, _| {}).expect("a capture");
    assert_eq!(replayed.difference.map(|difference| (difference.frame, difference.field)), Some((20, Field::Duty)));
}
