//! Jog, strokes and a press over the bus, on the flash image: each completes, and its record is read and parsed by the
//! host's solver. At the usual size there is no jog, and strokes and press are stopped on their way.

use crate::common::*;
use fingertip::capture::{CaptureState, Ended, Head};
use fingertip::measure::{MeasureState, Task};
use fingertip::shipped::CAPTURE_BYTES;
use replay::{Replayed, replay};
use solve::record::{self, Reason};

const LONGEST_MS: u64 = 20_000;

/// Makes a motion, which must complete without a fault.
fn measure(rig: &mut Rig, task: Task) {
    write_and_run_ms(rig, address::MEASURE, task as u8, 2);
    for _ in 0..LONGEST_MS / 20 {
        let mode = read_u8(rig, address::PRESENT_MODE);
        let state = read_u8(rig, address::MEASURE_STATE);
        if state != MeasureState::Running as u8 {
            let value = read_u32(rig, address::MEASURE_VALUE).cast_signed();
            let told = [address::MEASURE_ENDED, address::FAULT].map(|register| read_u8(rig, register));
            let loop_us = read_u16(rig, address::LOOP_TIME_MAX_US);
            let missed = read_u32(rig, address::MISSED_FRAMES);
            println!("{task:?}: {loop_us} us at most, {missed} frames missed");
            assert_eq!((state, told, value), (MeasureState::Done as u8, [0; 2], 0), "state, end and fault, value");
            return;
        }
        assert_eq!(mode, if task == Task::Press { Mode::Press } else { Mode::Strokes } as u8);
        rig.run_ms(20).expect("it runs");
    }
    panic!("it does not end: {} %", read_u8(rig, address::MEASURE_PROGRESS));
}

fn tare(rig: &mut Rig) {
    write_and_run_ms(rig, address::TARE, 1, 20);
    assert_eq!(read_u8(rig, address::TARE_STATE), 2);
}

/// Makes a motion, to its end or a part of it. Returns its record.
fn recorded(rig: &mut Rig, task: Task, whole: bool) -> Vec<u8> {
    tare(rig);
    if task == Task::Press {
        write_and_run_ms(rig, address::TORQUE_ENABLE, 1, 2);
    }
    if whole {
        measure(rig, task);
    } else {
        write_and_run_ms(rig, address::MEASURE, task as u8, 20);
        // The motor has moved forth and back, or the press whose steps are recorded has begun.
        let begun = if task == Task::Press { 30 } else { 5 };
        while read_u8(rig, address::MEASURE_PROGRESS) < begun {
            assert_eq!(read_u8(rig, address::MEASURE_STATE), MeasureState::Running as u8);
            rig.run_ms(20).expect("it runs");
        }
        write_and_run_ms(rig, address::MEASURE, Task::Stop as u8, 200);
        assert_eq!(read_u8(rig, address::MEASURE_ENDED), Reason::Interrupted as u8);
    }
    fetch(rig)
}

fn motions(whole: bool) {
    let setup = away(2.0);
    let mut rig = running(&setup, &fast_bus(0));
    if whole {
        tare(&mut rig);
        measure(&mut rig, Task::Jog);
    }
    write_param(&mut rig, "direction_confirmed", 1);
    let strokes = record::strokes(&recorded(&mut rig, Task::Strokes, whole), &Params::DEFAULT).expect("strokes");
    rig.world(|world| world.place(1.9)).expect("it runs");
    let press = record::press(&recorded(&mut rig, Task::Press, whole), &Params::DEFAULT).expect("a press");
    // The finger holds forces afterwards.
    write_goal(&mut rig, 500);
    rig.run_ms(300).expect("it runs");
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), Mode::Force as u8);
    let_go(&mut rig);
    rig.check_gaps().expect("no unknown gap");
    let reasons = [strokes.ended, press.ended].map(|ended| ended.map(|ended| ended.reason));
    if !whole {
        assert_eq!(reasons, [Some(Reason::Interrupted); 2]);
        assert!(!press.steps.is_empty());
        return;
    }
    assert_eq!((strokes.strokes.len(), reasons), (32, [None; 2]));
    let k = solve::strokes::solve(&strokes).expect("a drive").torque_constant.value / setup.motor.torque_nm_per_a;
    let kpa = solve::modulus(&[press]).expect("a modulus").kpa / setup.tip.modulus_kpa;
    println!("torque constant and modulus over the true ones: {k}, {kpa}");
    assert!((k - 1.0).abs() < 0.03 && (kpa - 1.0).abs() < 0.03, "{k} {kpa}");
}

sim::sizes!(motions_are_recorded_and_what_they_measure_is_solved, motions(false), motions(true));

// A capture over the bus, on the flash image: it replays to the bit on this machine, also with calibrated gains; and
// what becomes of one that is asked for out of turn, interrupted, or read while it is under way.

/// Errors of a status packet.
const RESULT: u8 = 1;
const ACCESS: u8 = 7;
const WINDOW: u16 = 248;

#[test]
fn captures_replay() {
    let rig = &mut running(&away(0.4), &fast_bus(1));
    out_of_turn_and_interrupted(rig);
    // What the finger did before is no part of a capture.
    write_and_run_ms(rig, address::TARE, 1, 20);
    drive(rig, 1_000);
    rig.run_ms(60).expect("it runs");
    let_go(rig);
    // Gains that are not 1: `host-tests/tests/capture.rs` replays presses with those that are.
    let taxels = [(44, 20_480_u16), (35, 12_288), (0, 8_192), (99, 32_767)];
    for (taxel, gain) in taxels {
        write_u16(rig, address::GAINS + 2 * taxel, gain);
    }
    rig.run_ms(5).expect("it runs");
    let head = a_press_replays_to_the_bit(rig);
    assert_eq!(taxels.map(|(taxel, _)| head.gains.get(taxel.into())), taxels.map(|(_, gain)| gain));
    a_reset_in_the_middle_leaves_nothing(rig);
}

fn capture_state(rig: &mut Rig) -> u8 {
    read_u8(rig, address::CAPTURE_STATE)
}

/// Arms, tares, and presses with half a newton from then on.
fn press(rig: &mut Rig) {
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    assert_eq!(capture_state(rig), CaptureState::Armed as u8);
    write_u8(rig, address::TARE, 1);
    drive(rig, 500);
    rig.run_ms(1).expect("it runs");
}

fn until_done(rig: &mut Rig) {
    for _ in 0..100 {
        rig.run_ms(5).expect("it runs");
        if read_u8_beside_a_capture(rig, address::CAPTURE_STATE) == CaptureState::Done as u8 {
            return;
        }
    }
    panic!("state {}, {} frames", capture_state(rig), read_u32(rig, address::CAPTURE_FRAMES));
}

/// Reads windows of a capture from the first byte to this length or beyond.
fn windows(rig: &mut Rig, length: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    for offset in (0..length).step_by(WINDOW.into()) {
        write_u32(rig, address::CAPTURE_OFFSET, offset);
        bytes.extend(read(rig, address::CAPTURE_DATA, WINDOW));
    }
    bytes
}

fn fetch(rig: &mut Rig) -> Vec<u8> {
    let length = read_u32(rig, address::CAPTURE_BYTES);
    let mut bytes = windows(rig, length);
    assert!(bytes[length as usize..].iter().all(|byte| *byte == 0), "zeros behind the end");
    bytes.truncate(length as usize);
    bytes
}

/// Reads a capture and replays it, which must be as the image answered; returns its length, too.
fn same(rig: &mut Rig) -> (Replayed<ROWS, COLUMNS>, Vec<Mode>, usize) {
    let (bytes, mut modes) = (fetch(rig), Vec::new());
    let replayed = replay::<ROWS, COLUMNS>(&bytes, &CLOCKS, |_, status| {
        if modes.last() != Some(&status.mode) {
            modes.push(status.mode);
        }
    });
    let replayed = replayed.expect("a capture");
    assert_eq!(replayed.difference, None);
    assert_eq!(replayed.head.frames, read_u32(rig, address::CAPTURE_FRAMES));
    assert_eq!(replayed.head.ended as u8, read_u8(rig, address::CAPTURE_ENDED));
    (replayed, modes, bytes.len())
}

fn a_press_replays_to_the_bit(rig: &mut Rig) -> Head<ROWS, COLUMNS> {
    let count = read_u8(rig, address::CAPTURE_COUNT);
    let missed = read_u32(rig, address::MISSED_FRAMES);
    let before_us = read_u16(rig, address::LOOP_TIME_MAX_US);
    press(rig);
    assert_eq!((capture_state(rig), read_u32(rig, address::CAPTURE_BYTES)), (CaptureState::Recording as u8, 0));
    // Read while it is under way: nothing, and no harm.
    assert_eq!(windows(rig, 1), [0; WINDOW as usize]);
    assert_eq!(refused(rig, address::CAPTURE, &[1]), ACCESS, "with torque on");
    until_done(rig);
    // Keeping frames costs none.
    assert_eq!((read_u8(rig, address::FAULT), read_u32(rig, address::MISSED_FRAMES)), (0, missed));
    let (replayed, modes, length) = same(rig);
    assert_eq!((replayed.head.ended, replayed.head.missed_frames), (Ended::Full, missed));
    assert_eq!(modes, [Mode::Tare, Mode::Off, Mode::Approach, Mode::Force]);
    let per_frame = length as f64 / f64::from(replayed.head.frames);
    println!("{} frames in {length} bytes, {per_frame:.1} a frame", replayed.head.frames);
    assert!(length <= CAPTURE_BYTES && replayed.head.frames > 600);
    let longest_us = read_u16(rig, address::LOOP_TIME_MAX_US);
    println!("the longest loop time: {before_us} us before, {longest_us} us with the capture");
    assert_eq!(read_u8(rig, address::CAPTURE_COUNT), count + 1);
    replayed.head
}

fn out_of_turn_and_interrupted(rig: &mut Rig) {
    // Armed twice is armed; called off is off.
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    assert_eq!(capture_state(rig), CaptureState::Armed as u8);
    write_and_run_ms(rig, address::CAPTURE, 0, 1);
    assert_eq!(capture_state(rig), CaptureState::None as u8);

    // Parameters between arming and the tare: those of the tare count.
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    write_param(rig, "modulus_pa", 260_000);
    assert_eq!(capture_state(rig), CaptureState::Armed as u8);
    write_and_run_ms(rig, address::TARE, 1, 8);
    assert_eq!(capture_state(rig), CaptureState::Recording as u8);
    assert_eq!(refused(rig, address::CAPTURE, &[1]), RESULT, "frames are being kept");
    write_and_run_ms(rig, address::CAPTURE, 0, 1);
    let (replayed, _, _) = same(rig);
    assert_eq!((replayed.head.ended, replayed.head.params.modulus_pa), (Ended::Asked, 260_000));
    assert!((60..160).contains(&replayed.head.frames), "{} frames", replayed.head.frames);

    // Parameters in the middle end it; what is there replays with those before.
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    write_and_run_ms(rig, address::TARE, 1, 20);
    write_param(rig, "modulus_pa", 250_000);
    let (replayed, modes, _) = same(rig);
    assert_eq!((replayed.head.ended, replayed.head.params.modulus_pa), (Ended::Configured, 260_000));
    assert_eq!(modes, [Mode::Tare, Mode::Off]);
}

fn a_reset_in_the_middle_leaves_nothing(rig: &mut Rig) {
    let_go(rig);
    write_and_run_ms(rig, address::CAPTURE, 1, 1);
    write_and_run_ms(rig, address::TARE, 1, 5);
    reboot(rig, 30);
    assert_eq!((capture_state(rig), read_u8(rig, address::CAPTURE_COUNT)), (CaptureState::None as u8, 0));
    assert_eq!((read_u32(rig, address::CAPTURE_BYTES), windows(rig, 1)), (0, vec![0; WINDOW.into()]));
}
