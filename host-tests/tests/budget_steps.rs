//! The budget frame by frame: when the effort falls, when it rises, and how long it waits.

use fingertip::contact::Effort;
use fingertip::pipeline::budget::{WAIT_MAX, WINDOW};
use fingertip::shipped::Budget;
use fingertip::units::CoreCycles;

/// Ticks that are all to be used.
const DEADLINE: u32 = 32_000;
const USABLE: u32 = 28_000;
/// What must be left free for a rise.
const ROOM: u32 = USABLE / 32;

/// At an effort, with nothing learnt yet.
fn at(effort: Effort) -> Budget {
    let mut budget = Budget::new();
    assert_eq!(budget.next(effort, CoreCycles(0), CoreCycles(DEADLINE)), effort);
    budget
}

fn most(effort: Effort) -> u32 {
    Budget::model_ticks(effort)[0]
}

/// Frames until the effort is another, at most so many.
fn frames_to_change(budget: &mut Budget, asked: Effort, taken: u32, at_most: u32) -> Option<(u32, Effort)> {
    let before = budget.next(asked, CoreCycles(taken), CoreCycles(DEADLINE));
    (2..=at_most).find_map(|frame| {
        let effort = budget.next(asked, CoreCycles(taken), CoreCycles(DEADLINE));
        (effort != before).then_some((frame, effort))
    })
}

#[test]
fn an_eighth_of_the_deadline_is_left() {
    assert_eq!([0, 7, 8, 80, 12_568, DEADLINE].map(Budget::usable), [0, 7, 7, 70, 10_997, USABLE]);
}

#[test]
fn quick_frames_let_it_rise_by_one_in_each_window_up_to_what_was_asked() {
    for asked in Effort::ALL {
        let mut budget = Budget::new();
        for frame in 1..=8 * WINDOW {
            let effort = budget.next(asked, CoreCycles(10), CoreCycles(DEADLINE));
            assert_eq!(effort, Effort::from_number((frame / WINDOW) as u8).min(asked), "frame {frame}, {asked:?}");
        }
        // What is asked less of is had at once.
        assert_eq!(budget.next(Effort::Sum, CoreCycles(10), CoreCycles(DEADLINE)), Effort::Sum);
    }
}

/// Without a contact the model's most comes on top of what a frame took; with one it is in it.
#[test]
fn it_falls_at_once_where_the_dearest_frame_would_not_fit() {
    for effort in [Effort::OneRow, Effort::TwoRows, Effort::FiveRows, Effort::AllRows] {
        for (modelled, longest) in [(false, USABLE - most(effort)), (true, USABLE)] {
            let mut budget = at(effort);
            budget.note(modelled);
            assert_eq!(budget.next(effort, CoreCycles(longest), CoreCycles(DEADLINE)), effort);
            assert_eq!(
                budget.next(effort, CoreCycles(longest + 1), CoreCycles(DEADLINE)),
                effort.lower(),
                "{effort:?}"
            );
        }
    }
    // There is nothing below the sum.
    assert_eq!(at(Effort::Sum).next(Effort::Sum, CoreCycles(2 * DEADLINE), CoreCycles(DEADLINE)), Effort::Sum);
}

#[test]
fn it_rises_where_the_next_effort_fits_with_room() {
    for effort in [Effort::Sum, Effort::Moments, Effort::OneRow, Effort::TwoRows, Effort::FiveRows] {
        let longest = USABLE - ROOM - most(effort.higher());
        for (taken, rises) in [(longest, Some((WINDOW, effort.higher()))), (longest + 1, None)] {
            let mut budget = at(effort);
            assert_eq!(frames_to_change(&mut budget, Effort::AllRows, taken, 20 * WINDOW), rises, "{effort:?}");
        }
    }
}

/// With a contact the frames at hand took at least the least for the model, so the rest is no more than what they took less that.
#[test]
fn with_a_contact_the_models_least_is_taken_off() {
    let (effort, next) = (Effort::OneRow, Effort::TwoRows);
    let longest = USABLE - ROOM - most(next) + Budget::model_ticks(effort)[1];
    for (taken, rises) in [(longest, Some((WINDOW, next))), (longest + 1, None)] {
        let mut budget = at(effort);
        budget.note(true);
        assert_eq!(frames_to_change(&mut budget, Effort::AllRows, taken, 20 * WINDOW), rises, "{taken}");
    }
}

/// It is the longest frame of the window that counts, and that of this window alone.
#[test]
fn one_long_frame_holds_it_back_for_its_window() {
    for long_frame in [1, 7, WINDOW - 1, WINDOW] {
        let mut budget = at(Effort::FiveRows);
        let long = USABLE - most(Effort::FiveRows);
        for frame in 1..=2 * WINDOW {
            let effort = budget.next(
                Effort::AllRows,
                CoreCycles(if frame == long_frame { long } else { 10 }),
                CoreCycles(DEADLINE),
            );
            let expected = if frame == 2 * WINDOW { Effort::AllRows } else { Effort::FiveRows };
            assert_eq!(effort, expected, "frame {frame}, long in {long_frame}");
        }
    }
}

/// One window after the first fall, twice as many after each further one.
#[test]
fn after_each_fall_it_waits_twice_as_long() {
    let mut budget = at(Effort::AllRows);
    let mut wait = 1;
    for _ in 0..11 {
        assert_eq!(budget.next(Effort::AllRows, CoreCycles(USABLE), CoreCycles(DEADLINE)), Effort::FiveRows);
        let rises = frames_to_change(&mut budget, Effort::AllRows, 10, 2 * WAIT_MAX * WINDOW);
        assert_eq!(rises, Some((wait * WINDOW, Effort::AllRows)));
        wait = (2 * wait).min(WAIT_MAX);
    }
    assert_eq!(wait, WAIT_MAX);
    // Another wish, or another deadline, begins anew.
    budget.next(Effort::AllRows, CoreCycles(USABLE), CoreCycles(DEADLINE));
    let rises = frames_to_change(&mut budget, Effort::FiveRows, 10, 10 * WINDOW);
    assert_eq!(rises, None, "it has what it asks");
    let rises = frames_to_change(&mut budget, Effort::AllRows, 10, 10 * WINDOW);
    assert_eq!(rises, Some((WINDOW, Effort::AllRows)));
}

/// A contact that comes or goes makes the frames before worth nothing.
#[test]
fn a_contact_that_comes_or_goes_begins_the_window_anew() {
    for before in [1, 10, WINDOW - 1] {
        let mut budget = at(Effort::OneRow);
        for _ in 0..before {
            assert_eq!(budget.next(Effort::AllRows, CoreCycles(2_000), CoreCycles(DEADLINE)), Effort::OneRow);
            budget.note(false);
        }
        budget.note(true);
        budget.note(true);
        let rises = frames_to_change(&mut budget, Effort::AllRows, 2_000, 3 * WINDOW);
        assert_eq!(rises, Some((WINDOW, Effort::TwoRows)), "after {before}");
    }
}

/// By the estimate: the start 2,100 cycles, a row 1,000, and the solution 1,600 where it falls into the same frame.
#[test]
fn the_dearest_frame_is_the_start_and_the_rows_of_an_effort() {
    for (effort, rows, solution) in
        [(Effort::OneRow, 1, 0), (Effort::TwoRows, 2, 0), (Effort::FiveRows, 5, 0), (Effort::AllRows, 10, 1_600)]
    {
        let [most, least] = Budget::model_ticks(effort);
        assert_eq!(most, 2_100 + 1_000 * rows + solution, "{effort:?}");
        assert!((most / 4..=most / 2).contains(&least), "{effort:?}: {least}");
    }
    assert_eq!([Effort::Sum, Effort::Moments].map(Budget::model_ticks), [[0; 2]; 2]);
}

/// Frames that are too long even by the sum are no falls: nothing has to be waited for after them.
#[test]
fn there_is_no_fall_below_the_sum() {
    let mut budget = at(Effort::Sum);
    for _ in 0..10 {
        assert_eq!(budget.next(Effort::AllRows, CoreCycles(DEADLINE), CoreCycles(DEADLINE)), Effort::Sum);
    }
    // The window that they were in, and the next.
    let rises = frames_to_change(&mut budget, Effort::AllRows, 10, 10 * WINDOW);
    assert_eq!(rises, Some((2 * WINDOW - 10, Effort::Moments)));
}
