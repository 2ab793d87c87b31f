//! Each fault natively: found in time, latched, and cleared only with torque off. And the commands to the bridge in
//! each mode, and in the middle of the scan of a frame.

use crate::common::*;

/// Interference in a single frame is no fault: the motor is shorted during that frame, and the contact keeps its
/// values. The same taxels bad twice are a fault, and so is half of the array at once.
#[test]
fn taxels_that_are_bad_for_one_frame_are_no_fault() {
    let mut board = holding(1_000);
    let spoil = |board: &mut Bench, first: usize, count: usize| {
        board.step_with(|record| {
            (first..first + count).for_each(|place| record.frame.set_code(place / 10 % 10, place % 10, 0));
        })
    };
    let before = board.step().contact;
    for number in 0..200 {
        let status = spoil(&mut board, 12 * number, 12);
        assert_eq!((status.fault, status.duty.0, status.contact), (None, 0, before), "{number}");
        assert!(status.limits.has(Limits::TAXELS));
    }
    assert!((0.9..1.1).contains(&board.truth().force_n), "{} N", board.truth().force_n);
    spoil(&mut board, 0, 12);
    assert_eq!(spoil(&mut board, 6, 12).fault, Some(Fault::ArrayBroken));
    assert_eq!(spoil(&mut holding(1_000), 0, 51).fault, Some(Fault::ArrayBroken));
}

#[test]
fn taxels_that_die_within_the_contact_do_not_change_the_force() {
    for goal_mn in [200, 1_000, 4_000] {
        let mut board = holding(goal_mn);
        let allowed = board.pipeline().config().params.bad_taxels_max as usize;
        let middle = [(4, 4), (4, 5), (5, 4), (5, 5), (3, 4), (6, 5)];
        board.harm(|faults| {
            middle[..allowed].iter().for_each(|(row, column)| faults.array.taxels[*row][*column] = Taxel::Dead)
        });
        let largest_n = board.run(1.0);
        let Status { limits, contact, .. } = *board.status();
        assert!(limits.has(Limits::TAXELS) && usize::from(contact.bad_taxels) == allowed, "{contact:?}");
        let (held_n, goal_n) = (board.truth().force_n, f64::from(goal_mn) * 1e-3);
        let near = (held_n - goal_n).abs() <= 0.05 * goal_n + 0.01 && largest_n <= 1.1 * goal_n + 0.02;
        assert!(near, "goal {goal_n} N: at most {largest_n:.3} N, {}", told(&mut board));
    }
}

/// Noise at no force looks like an indentation that the encoder does not see: it is no fault, however long it lasts.
#[test]
fn noise_at_no_force_is_not_a_frozen_encoder() {
    let mut board = ready();
    for number in 0..5_000 {
        let more = if number % 10 < 5 { 2 } else { 0 };
        let status = board.step_with(|record| recode(&mut record.frame, |_, _, code| code + more));
        assert_eq!(status.fault, None, "frame {number}");
    }
}

/// A host that is back within the release finds its fault: at once with torque off or a new configuration, else once the
/// object is released.
#[test]
fn nothing_that_arrives_ends_a_release_for_a_silent_bus() {
    let requests: [fn(&mut Bench); 7] = [
        |board| board.command().torque = false,
        |board| board.command().goal = newtons(5_000),
        |board| board.command().tare_request += 1,
        |board| board.command().clear_request += 1,
        |board| board.request(Task::Press),
        |board| {
            let config = board.pipeline().config().clone();
            board.pipeline().configure(&config);
        },
        |_| {},
    ];
    for (number, request) in requests.into_iter().enumerate() {
        let mut board = holding(3_000);
        board.command().bus_watchdog_ms = 40;
        let mut silent_for = |ms| board.step_with(|record| record.sense.bus_silent_ms = ms).mode;
        assert_eq!((silent_for(39), silent_for(40)), (Mode::Force, Mode::Release));
        board.frames(20);
        request(&mut board);
        let frames = (0..5_001).find(|_| board.step().mode != Mode::Release);
        let (status, left_n) = (*board.status(), board.truth().force_n);
        assert_eq!((status.mode, status.fault), (Mode::Fault, Some(Fault::BusSilent)), "{number}: {frames:?}");
        let at_once = [0, 5].contains(&number);
        assert!(if at_once { frames == Some(0) } else { left_n == 0.0 }, "{number}: {left_n} N after {frames:?}");
        assert_ne!(status.tare, Taring::Running, "{number}");
    }
}

/// Frames whose numbers grow by a step: what is missed is counted, and a frame that comes again twice is a fault.
#[test]
fn missed_frames_are_counted_and_repeated_ones_are_not_new() {
    let (mut board, mut ahead) = (holding(1_000), 0);
    for (step, missed_frames, flagged, fault) in [
        (4, 3, true, None),
        (1, 3, false, None),
        (0, 3, true, None),
        (1, 3, false, None),
        (0, 3, true, None),
        (0, 3, true, Some(Fault::LostFrames)),
    ] {
        ahead += step - 1;
        let status = board.step_with(|record| record.frame.sequence = record.frame.sequence.wrapping_add_signed(ahead));
        let found = (status.missed_frames, status.limits.has(Limits::FRAME_MISSED), status.fault);
        assert_eq!(found, (missed_frames, flagged, fault), "{step} behind {ahead}");
    }
}

/// More dead taxels than allowed short a driven motor in the middle of a frame. The verdict is left to the step.
#[test]
fn a_part_of_a_frame_shorts_only_a_driven_motor_and_only_if_it_is_broken() {
    let dead = |frame: &Frame, rows: std::ops::Range<usize>| {
        let mut frame = *frame;
        rows.for_each(|place| frame.set_code(place, place, 0));
        frame
    };
    let mut board = holding(1_000);
    let before = *board.status();
    assert!(before.duty.0 > 0);
    let allowed = board.pipeline().config().params.bad_taxels_max as usize;
    for count in [0, allowed] {
        let frame = dead(board.frame(), 0..count);
        assert!(!board.pipeline().begin(&frame, ROWS), "{count} dead taxels");
        assert_eq!(*board.status(), before, "{count} dead taxels");
    }
    // Those of the last step count in the rows that are still to come.
    let last = dead(board.frame(), ROWS - allowed..ROWS);
    let record = board.record();
    board.pipeline().step(&last, &record.sense, &record.command);
    let frame = dead(&last, 0..1);
    assert!(!board.pipeline().begin(&frame, 0));
    assert!(board.pipeline().begin(&frame, 1));
    // A row that is stuck on shows in the slot without a row, which comes first.
    let mut stuck = *board.frame();
    stuck.set_code(ROWS, 3, 2_000);
    assert!(board.pipeline().begin(&stuck, 0));
    let after = *board.status();
    assert_eq!((after.mode, after.fault, after.duty.0), (Mode::Force, None, 0));
    board.command().torque = false;
    assert_eq!(board.step().mode, Mode::Off);
    assert!(!board.pipeline().begin(&frame, ROWS), "the bridge is off");
}

type End = fn(&mut Bench);

/// However a drive ends, the motor is shorted until the tip was at rest for 20 ms. Then the bridge opens for good.
#[test]
fn a_motor_that_was_driven_brakes_until_the_tip_rests() {
    let endings: [(&str, End); 4] = [
        ("torque off", |board| board.command().torque = false),
        ("tare", |board| (board.command().torque, board.command().tare_request) = (false, 77)),
        ("parameters", |board| {
            let config = board.pipeline().config().clone();
            board.pipeline().configure(&config);
            board.command().torque = false;
            assert_eq!((board.status().mode, board.status().bridge()), (Mode::Off, Bridge::Brakes), "at once");
        }),
        ("fault", |board| {
            board.pipeline().stop(Fault::LostFrames);
            assert_eq!((board.status().mode, board.status().bridge()), (Mode::Fault, Bridge::Brakes), "at once");
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
