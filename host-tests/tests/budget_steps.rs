//! The budget frame by frame: when the fit level falls, when it rises, and how long it waits.

use fingertip::contact::FitLevel;
use fingertip::pipeline::budget::{WAIT_MAX, WINDOW};
use fingertip::shipped::Budget;
use fingertip::units::CoreCycles;

/// Ticks that are all to be used.
const DEADLINE: u32 = 32_000;
const USABLE: u32 = 28_000;
/// What must be left free for a rise.
const ROOM: u32 = USABLE / 32;

/// At a fit level, with nothing learnt yet.
fn at(fit_level: FitLevel) -> Budget {
    let mut budget = Budget::new();
    assert_eq!(budget.next(fit_level, CoreCycles(0), CoreCycles(DEADLINE)), fit_level);
    budget
}

fn most(fit_level: FitLevel) -> u32 {
    Budget::model_cycles(fit_level)[0]
}

/// Frames until the fit level is another, at most so many.
fn frames_to_change(budget: &mut Budget, asked: FitLevel, taken: u32, at_most: u32) -> Option<(u32, FitLevel)> {
    let before = budget.next(asked, CoreCycles(taken), CoreCycles(DEADLINE));
    (2..=at_most).find_map(|frame| {
        let fit_level = budget.next(asked, CoreCycles(taken), CoreCycles(DEADLINE));
        (fit_level != before).then_some((frame, fit_level))
    })
}

#[test]
fn an_eighth_of_the_deadline_is_left() {
    assert_eq!([0, 7, 8, 80, 12_568, DEADLINE].map(Budget::usable), [0, 7, 7, 70, 10_997, USABLE]);
}

#[test]
fn quick_frames_let_it_rise_by_one_in_each_window_up_to_what_was_asked() {
    for asked in FitLevel::ALL {
        let mut budget = Budget::new();
        for frame in 1..=8 * WINDOW {
            let fit_level = budget.next(asked, CoreCycles(10), CoreCycles(DEADLINE));
            assert_eq!(fit_level, FitLevel::from_number((frame / WINDOW) as u8).min(asked), "frame {frame}, {asked:?}");
        }
        // What is asked less of is had at once.
        assert_eq!(budget.next(FitLevel::Sum, CoreCycles(10), CoreCycles(DEADLINE)), FitLevel::Sum);
    }
}

/// Without a contact the model's most comes on top of what a frame took; with one it is in it.
#[test]
fn it_falls_at_once_where_the_dearest_frame_would_not_fit() {
    for fit_level in [FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
        for (modelled, longest) in [(false, USABLE - most(fit_level)), (true, USABLE)] {
            let mut budget = at(fit_level);
            budget.note(modelled);
            assert_eq!(budget.next(fit_level, CoreCycles(longest), CoreCycles(DEADLINE)), fit_level);
            assert_eq!(
                budget.next(fit_level, CoreCycles(longest + 1), CoreCycles(DEADLINE)),
                fit_level.lower(),
                "{fit_level:?}"
            );
        }
    }
    // There is nothing below the sum.
    assert_eq!(at(FitLevel::Sum).next(FitLevel::Sum, CoreCycles(2 * DEADLINE), CoreCycles(DEADLINE)), FitLevel::Sum);
}

#[test]
fn it_rises_where_the_next_effort_fits_with_room() {
    for fit_level in [FitLevel::Sum, FitLevel::Moments, FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows] {
        let longest = USABLE - ROOM - most(fit_level.higher());
        for (taken, rises) in [(longest, Some((WINDOW, fit_level.higher()))), (longest + 1, None)] {
            let mut budget = at(fit_level);
            assert_eq!(frames_to_change(&mut budget, FitLevel::AllRows, taken, 20 * WINDOW), rises, "{fit_level:?}");
        }
    }
}

/// With a contact the frames at hand took at least the least for the model, so the rest is no more than what they took
/// less that.
#[test]
fn with_a_contact_the_models_least_is_taken_off() {
    let (fit_level, next) = (FitLevel::OneRow, FitLevel::TwoRows);
    let longest = USABLE - ROOM - most(next) + Budget::model_cycles(fit_level)[1];
    for (taken, rises) in [(longest, Some((WINDOW, next))), (longest + 1, None)] {
        let mut budget = at(fit_level);
        budget.note(true);
        assert_eq!(frames_to_change(&mut budget, FitLevel::AllRows, taken, 20 * WINDOW), rises, "{taken}");
    }
}

/// It is the longest frame of the window that counts, and that of this window alone.
#[test]
fn one_long_frame_holds_it_back_for_its_window() {
    for long_frame in [1, 7, WINDOW - 1, WINDOW] {
        let mut budget = at(FitLevel::FiveRows);
        let long = USABLE - most(FitLevel::FiveRows);
        for frame in 1..=2 * WINDOW {
            let fit_level = budget.next(
                FitLevel::AllRows,
                CoreCycles(if frame == long_frame { long } else { 10 }),
                CoreCycles(DEADLINE),
            );
            let expected = if frame == 2 * WINDOW { FitLevel::AllRows } else { FitLevel::FiveRows };
            assert_eq!(fit_level, expected, "frame {frame}, long in {long_frame}");
        }
    }
}

/// One window after the first fall, twice as many after each further one.
#[test]
fn after_each_fall_it_waits_twice_as_long() {
    let mut budget = at(FitLevel::AllRows);
    let mut wait = 1;
    for _ in 0..11 {
        assert_eq!(budget.next(FitLevel::AllRows, CoreCycles(USABLE), CoreCycles(DEADLINE)), FitLevel::FiveRows);
        let rises = frames_to_change(&mut budget, FitLevel::AllRows, 10, 2 * WAIT_MAX * WINDOW);
        assert_eq!(rises, Some((wait * WINDOW, FitLevel::AllRows)));
        wait = (2 * wait).min(WAIT_MAX);
    }
    assert_eq!(wait, WAIT_MAX);
    // Another wish, or another deadline, begins anew.
    budget.next(FitLevel::AllRows, CoreCycles(USABLE), CoreCycles(DEADLINE));
    let rises = frames_to_change(&mut budget, FitLevel::FiveRows, 10, 10 * WINDOW);
    assert_eq!(rises, None, "it has what it asks");
    let rises = frames_to_change(&mut budget, FitLevel::AllRows, 10, 10 * WINDOW);
    assert_eq!(rises, Some((WINDOW, FitLevel::AllRows)));
}

/// A contact that comes or goes makes the frames before worth nothing.
#[test]
fn a_contact_that_comes_or_goes_begins_the_window_anew() {
    for before in [1, 10, WINDOW - 1] {
        let mut budget = at(FitLevel::OneRow);
        for _ in 0..before {
            assert_eq!(budget.next(FitLevel::AllRows, CoreCycles(2_000), CoreCycles(DEADLINE)), FitLevel::OneRow);
            budget.note(false);
        }
        budget.note(true);
        budget.note(true);
        let rises = frames_to_change(&mut budget, FitLevel::AllRows, 2_000, 3 * WINDOW);
        assert_eq!(rises, Some((WINDOW, FitLevel::TwoRows)), "after {before}");
    }
}

/// By the estimate: the start 2,100 cycles, a row 1,000, and the solution 1,600 where it falls into the same frame.
#[test]
fn the_dearest_frame_is_the_start_and_the_rows_of_an_effort() {
    for (fit_level, rows, solution) in [
        (FitLevel::OneRow, 1, 0),
        (FitLevel::TwoRows, 2, 0),
        (FitLevel::FiveRows, 5, 0),
        (FitLevel::AllRows, 10, 1_600),
    ] {
        let [most, least] = Budget::model_cycles(fit_level);
        assert_eq!(most, 2_100 + 1_000 * rows + solution, "{fit_level:?}");
        assert!((most / 4..=most / 2).contains(&least), "{fit_level:?}: {least}");
    }
    assert_eq!([FitLevel::Sum, FitLevel::Moments].map(Budget::model_cycles), [[0; 2]; 2]);
}

/// Frames that are too long even by the sum are no falls: nothing has to be waited for after them.
#[test]
fn there_is_no_fall_below_the_sum() {
    let mut budget = at(FitLevel::Sum);
    for _ in 0..10 {
        assert_eq!(budget.next(FitLevel::AllRows, CoreCycles(DEADLINE), CoreCycles(DEADLINE)), FitLevel::Sum);
    }
    // The window that they were in, and the next.
    let rises = frames_to_change(&mut budget, FitLevel::AllRows, 10, 10 * WINDOW);
    assert_eq!(rises, Some((2 * WINDOW - 10, FitLevel::Moments)));
}
