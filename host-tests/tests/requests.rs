//! Requests in the loop: all of one frame are executed, refused ones are reported. Also the first frame with torque.

use crate::common::*;

const RUNNING: MeasureStatus = MeasureStatus::running(Task::Press);

/// With the object so far away.
fn at(distance_mm: f64) -> Bench {
    let mut board = Bench::default();
    board.place_object(distance_mm);
    board
}

/// Tared, at rest with torque on.
fn ready() -> Bench {
    let mut board = crate::common::ready();
    board.step();
    board
}

/// Stopped by an overload of the bridge that is over.
fn faulted() -> Bench {
    let mut board = ready();
    assert_eq!(board.step_with(overloaded).fault, Some(Fault::Bridge));
    board.command().torque = false;
    board
}

/// Change of a record that makes a step a fault.
type Spoil = fn(&mut Record);

/// A fault that is found before the contact is estimated, and one that is found later.
const EARLY_AND_LATE: [(Spoil, Fault); 2] = [(broken, Fault::ArrayBroken), (silent, Fault::BusSilent)];

fn broken(record: &mut Record) {
    let mut board = Bench::default();
    board.harm(|faults| faults.array.taxels = [[Taxel::Dead; 10]; 10]);
    board.step();
    record.frame.codes = board.frame().codes;
}

fn overloaded(record: &mut Record) {
    record.sense.bridge_fault = true;
}

fn silent(record: &mut Record) {
    (record.command.bus_watchdog_ms, record.sense.bus_silent_ms) = (20, 20);
}

/// By about 14 N.
fn pressed(record: &mut Record) {
    let mut board = at(-4.2);
    board.step();
    record.frame.codes = board.frame().codes;
}

/// A tare was requested these frames ago.
fn taring(frames: u32) -> Bench {
    let mut board = Bench::default();
    tare_for(&mut board, frames);
    board
}

fn tare_for(board: &mut Bench, frames: u32) {
    board.command().tare_request += 1;
    board.frames(frames);
}

/// A tare lasts for these frames.
fn tares(board: &mut Bench, frames: u32, name: &str) {
    for _ in 0..frames {
        let Status { mode, tare, duty, .. } = board.step();
        assert_eq!((mode, tare, duty), (Mode::Tare, Taring::Running, Duty::ZERO), "{name}");
    }
    assert_eq!(board.step().tare, Taring::Done, "{name}");
}

/// Another change in the frame of a request.
type Change = fn(&mut Bench);

/// Each board with the mode after the tare.
#[test]
fn a_tare_that_comes_with_another_request_is_done() {
    let peak: Change = |board| {
        board.command().torque = false;
        board.step_with(pressed);
    };
    let cases: [(&str, Bench, Change, Mode); 5] = [
        ("a frame that reads too much, just before", ready(), peak, Mode::Off),
        ("torque off", ready(), |board| board.command().torque = false, Mode::Off),
        ("torque off and on again, before the loop looks", ready(), |_| {}, Mode::Release),
        ("the clearing of a fault", faulted(), |board| board.command().clear_request += 1, Mode::Off),
        ("another tare under way", taring(100), |_| {}, Mode::Off),
    ];
    for (name, mut board, change, after) in cases {
        change(&mut board);
        board.command().tare_request += 1;
        tares(&mut board, TARE_FRAMES, name);
        assert_eq!((board.status().mode, board.step().mode), (Mode::Off, after), "{name}");
    }
}

/// The array is the same, so is its tare, to the rounding of its means.
#[test]
fn a_tare_does_not_depend_on_the_one_before() {
    let mut board = Bench::default();
    let mut tared = || {
        board.tare();
        let array = board.pipeline().array();
        (array.tare().flatten().copied().collect::<Vec<_>>(), array.picture().sum)
    };
    let (first, sum) = tared();
    assert!(first.iter().all(|tare| *tare > 20 << TARE_BITS) && sum.abs() < 100, "{sum}");
    let (second, sum) = tared();
    let worst = first.iter().zip(&second).map(|(first, second)| first.abs_diff(*second)).max().unwrap();
    assert!(worst < 1 << (TARE_BITS - 4) && sum.abs() < 100, "{worst}, {sum}");
}

#[test]
fn new_parameters_during_a_tare_begin_it_anew() {
    let mut board = taring(100);
    board.pipeline().configure(&config());
    tares(&mut board, TARE_FRAMES - 1, "new parameters");
}

#[test]
fn new_parameters_do_not_hide_what_is_pressed() {
    let mut board = Bench::default();
    board.tare();
    board.command().torque = false;
    board.place_object(-0.8);
    board.frames(100);
    board.pipeline().configure(&config());
    board.command().tare_request += 1;
    assert_eq!(board.step().tare, Taring::Refused);
}

#[test]
fn a_press_that_comes_with_torque_or_during_a_tare_waits_for_the_drive() {
    let mut board = taring(1);
    board.command().torque = true;
    board.request(Task::Press);
    let mut frames = 0;
    while board.step().mode != Mode::Press {
        frames += 1;
        assert!(frames < TARE_FRAMES + 5);
        assert_eq!(board.status().measure, MeasureStatus::default());
    }
    assert_eq!(board.step().measure, RUNNING);

    let mut board = ready();
    board.command().torque = false;
    board.step();
    board.command().torque = true;
    board.request(Task::Press);
    assert_eq!(board.step().mode, Mode::Press);
}

fn touched(board: &mut Bench) {
    board.place_object(-0.8);
    board.frames(20);
}

fn tared_touching(board: &mut Bench) {
    touched(board);
    tare_for(board, 700);
}

fn torque_on(board: &mut Bench) {
    board.command().torque = true;
    board.step();
}

/// A change of a finger that is tared or not, at rest without torque; and how a jog, strokes and a press end after it,
/// `None` if the motion begins.
type Case = (&'static str, bool, Change, [Option<Ended>; 3]);

#[test]
fn every_state_has_its_answer() {
    const NO: Option<Ended> = Some(Ended::NotReady);
    let states: [Case; 10] = [
        ("not tared", false, |_| {}, [NO; 3]),
        ("not tared, torque on", false, torque_on, [NO; 3]),
        ("tared", true, |_| {}, [None, None, NO]),
        (
            "unconfirmed",
            true,
            |board| board.pipeline().configure(&allowed(Params::DEFAULT)),
            [None, Some(Ended::Unconfirmed), NO],
        ),
        ("torque on", true, torque_on, [NO, NO, None]),
        ("taring", true, |board| tare_for(board, 1), [NO; 3]),
        ("touching", true, touched, [NO; 3]),
        ("tared while touching", false, tared_touching, [NO; 3]),
        ("gains changed", true, |board| board.pipeline().calibrate(&Calibration::NONE), [NO; 3]),
        ("fault", true, |board| board.pipeline().stop(Fault::Bridge), [NO; 3]),
    ];
    for (name, tared, change, answers) in states {
        for (task, answer) in [Task::Jog, Task::Strokes, Task::Press].into_iter().zip(answers) {
            let mut board = if tared { crate::common::ready() } else { Bench::default() };
            board.command().torque = false;
            board.frames(if tared { 200 } else { 0 });
            change(&mut board);
            board.request(task);
            let status = board.step();
            let (measure, taken) = (status.measure, status.taken.measure);
            assert_eq!((measure.task, taken), (task, board.command().measure_request), "{name}");
            let began = (MeasureState::Running, Ended::Complete);
            let expected = answer.map_or(began, |ended| (MeasureState::Ended, ended));
            assert_eq!((measure.state, measure.ended), expected, "{name}: {task:?}");
            assert_eq!(matches!(status.mode, Mode::Press | Mode::Strokes), answer.is_none(), "{name}: {task:?}");
        }
    }
}

/// Like every later frame: not driven at all where it shows a fault. Without torque a wrong supply is no fault.
#[test]
fn the_first_frame_with_torque_is_judged_before_it_drives() {
    let supplies: [(Spoil, Fault); 2] = [
        (|record| record.sense.supply_mv = 3_000, Fault::SupplyLow),
        (|record| record.sense.supply_mv = 60_000, Fault::SupplyHigh),
    ];
    let others: [(Spoil, Fault); 2] = [(overloaded, Fault::Bridge), (pressed, Fault::OverForce)];
    let judged = EARLY_AND_LATE.into_iter().chain(others).map(|case| (case, 0));
    for ((spoil, fault), frames_before) in judged.chain(supplies.map(|case| (case, 10))) {
        let mut board = crate::common::ready();
        board.command().torque = false;
        board.command().goal = newtons(7_000);
        board.step();
        for _ in 0..frames_before {
            assert_eq!(board.step_with(spoil).fault, None, "{fault:?} without torque");
        }
        board.command().torque = true;
        let status = board.step_with(spoil);
        assert_eq!((status.fault, status.duty.0), (Some(fault), 0));
    }
}

/// A tip that is faster than half of the approach speed is braked first, and driven from there on.
#[test]
fn torque_waits_until_the_tip_is_slow() {
    let mut board = ready();
    let config = config();
    let (count_mm, frame_s): (f64, _) = (config.count.0.to_num(), f64::from(config.timing.frame_ns) * 1e-9);
    board.command().torque = false;
    let mut travel_mm = 0.0;
    let mut moves = |board: &mut Bench, speed_mm_per_s: f64| {
        travel_mm += speed_mm_per_s * frame_s;
        board.step_with(|record| record.sense.encoder = (travel_mm / count_mm).floor() as i32)
    };
    for speed in [20.0, -20.0] {
        for _ in 0..500 {
            assert_eq!(moves(&mut board, speed).mode, Mode::Off);
        }
        board.command().torque = true;
        for _ in 0..300 {
            let status = moves(&mut board, speed);
            assert_eq!((status.mode, status.bridge()), (Mode::Off, Bridge::Brakes), "at {speed} mm/s");
        }
        // Half of 30 mm/s, within the resolution of the encoder's speed.
        let mut slower = speed;
        while moves(&mut board, slower).mode == Mode::Off {
            slower *= 0.999;
        }
        assert!((13.0..17.5).contains(&slower.abs()), "driven from {slower} mm/s on");
        board.command().torque = false;
        for _ in 0..1_000 {
            moves(&mut board, 0.0);
        }
        assert_eq!(board.status().bridge(), Bridge::Open);
    }
}

#[test]
fn torque_that_was_on_before_a_tare_or_a_configuration_drives_nothing_until_it_was_off() {
    let tare: fn(&mut Bench) = |board| board.command().tare_request += 1;
    let configure: fn(&mut Bench) = |board| board.pipeline().configure(&config());
    let calibrate: fn(&mut Bench) = |board| {
        board.pipeline().calibrate(&Calibration::NONE);
        board.command().tare_request += 1;
    };
    // Frames without torque and with it before the change.
    let untared = [(0, 0), (0, 1), (0, 100), (1, 1), (1, 100)].map(|frames| (at(5.0), frames, tare));
    let tared = [configure, calibrate].map(|change| (ready(), (0, 0), change));
    for (number, (mut board, (off_first, frames), change)) in untared.into_iter().chain(tared).enumerate() {
        board.command().goal = newtons(1_000);
        board.frames(off_first);
        board.command().torque = true;
        let Status { mode, limits, .. } = board.frames(frames);
        assert!(frames == 0 || mode == Mode::Off && limits.has(Limits::NOT_TARED), "{number}: {mode:?}");
        change(&mut board);
        for _ in 0..2 * TARE_FRAMES {
            let status = board.step();
            assert!(matches!(status.mode, Mode::Off | Mode::Tare) && status.limits.has(Limits::TORQUE_HELD));
            assert_eq!(status.duty.0, 0);
        }
        board.command().torque = false;
        board.step();
        board.command().torque = true;
        assert_eq!((board.step().mode, board.status().tare), (Mode::Approach, Taring::Done), "{number}");
    }
}

#[test]
fn torque_that_comes_with_a_tare_or_during_it_waits_for_its_end() {
    for after in [0, 1, TARE_FRAMES / 2, TARE_FRAMES] {
        let mut board = at(5.0);
        board.command().goal = newtons(1_000);
        board.step();
        board.command().tare_request += 1;
        board.frames(after);
        board.command().torque = true;
        for _ in after..=TARE_FRAMES {
            assert_eq!(board.step().duty.0, 0);
        }
        assert_eq!((board.step().mode, board.status().tare), (Mode::Approach, Taring::Done), "after {after} frames");
    }
}

/// Before a tare the array's offsets look like a contact: none is reported, only defects of the array are.
#[test]
fn before_a_tare_no_contact_is_reported() {
    let mut board = at(-2.0);
    board.harm(|faults| faults.array.taxels[3][4] = Taxel::Dead);
    for _ in 0..10 {
        assert_eq!(board.step().contact, Contact { bad_taxels: 1, ..Contact::default() });
    }
    board.command().tare_forced = true;
    board.tare();
    assert_ne!(board.step().contact, Contact { bad_taxels: 1, ..Contact::default() });
}

/// The flag of a tare under a touch lasts until the next tare, also where that is not judged, since the tip was released.
#[test]
fn a_tare_of_a_released_tip_is_not_flagged_by_the_one_before() {
    let flagged = |board: &mut Bench| board.step().limits.has(Limits::TARED_TOUCHING);
    let mut board = ready();
    board.hold(0, 0.1);
    board.place_object(-0.3);
    board.command().tare_forced = true;
    board.tare();
    assert!(flagged(&mut board), "{}", told(&mut board));
    board.hold(1_000, 0.5);
    board.hold(0, 0.5);
    board.command().tare_forced = false;
    board.tare();
    assert!(!flagged(&mut board), "{}", told(&mut board));
    board.hold(1_000, 0.5);
    assert_eq!(board.step().mode, Mode::Force, "{}", told(&mut board));
}
