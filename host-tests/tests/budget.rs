//! Budget of the loop's time, for any distribution of the frames' times.

use crate::common::*;
use fingertip::pipeline::budget::{WAIT_MAX, WINDOW};
use fingertip::shipped::Budget;

/// Three quarters of a frame at 10 kHz, ticks.
const DEADLINE: u32 = 12_568;

/// Frames of the longest refinement, of which only one is the dearest, and one more.
const REFINEMENT: u32 = 12;

/// Frame time: `rest`, up to `spread` more, and with a contact that of the level, the largest at a `model_q8` of 256.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    frames: u32,
    rest: u32,
    spread: u32,
    contact: bool,
    model_q8: u32,
}

fn stretch() -> impl Strategy<Value = Stretch> {
    (1..400_u32, 1_000..9_000_u32, 0..500_u32, prop::bool::ANY, 0..=256_u32)
        .prop_map(|(frames, rest, spread, contact, model_q8)| Stretch { frames, rest, spread, contact, model_q8 })
}

struct Loop {
    budget: Budget,
    taken: u32,
    turn: u32,
    random: fastrand::Rng,
}

impl Loop {
    fn new() -> Self {
        Self { budget: Budget::new(), taken: 1, turn: 0, random: fastrand::Rng::with_seed(2003) }
    }

    /// A frame: the fit level and how long it took.
    fn frame(&mut self, asked: FitLevel, deadline: u32, with: &Stretch) -> (FitLevel, u32) {
        let fit_level = self.budget.next(asked, CoreCycles(self.taken), CoreCycles(deadline));
        let [most, least] = Budget::model_cycles(fit_level);
        self.taken = with.rest + self.random.u32(0..=with.spread);
        if with.contact && most > 0 {
            // The longest frame is one of several, which come in turn; the rest take a part of its time.
            self.turn = (self.turn + 1) % (REFINEMENT - 1);
            self.taken +=
                (least + (((most - least) * with.model_q8) >> 8)) * (REFINEMENT - 1 - self.turn) / (REFINEMENT - 1);
        }
        self.budget.note(Some(with.contact && most > 0));
        (fit_level, self.taken)
    }
}

proptest! {
    #![proptest_config(seeded(800, 2003))]

    /// A deadline is missed only where the rest jumps by more than the margin. Where there is room, the effort comes
    /// back and stays.
    #[test]
    fn no_deadline_is_missed_and_the_effort_comes_back(
        asked in 0..6_u8,
        stretches in proptest::collection::vec(stretch(), 0..12),
        rest in 1_000..9_000_u32,
        contact in prop::bool::ANY,
    ) {
        let mut running = Loop::new();
        let asked = FitLevel::from_number(asked);
        let margin = DEADLINE - Budget::usable(DEADLINE);
        // Long enough for the longest wait.
        let calm = Stretch { frames: (WAIT_MAX + 12) * WINDOW, rest, spread: 100, contact, model_q8: 256 };
        let (mut before, mut levels) = (None, BTreeSet::new());
        for stretch in stretches.iter().chain([&calm; 2]) {
            levels.clear();
            for frame in 0..stretch.frames {
                let (fit_level, taken) = running.frame(asked, DEADLINE, stretch);
                prop_assert!(fit_level <= asked);
                levels.insert(fit_level);
                // The last measurement covers all but a jump of the rest and of the contact.
                let jumped = before.is_none_or(|before: Stretch| stretch.rest + stretch.spread > before.rest + margin);
                if taken > DEADLINE {
                    prop_assert!(frame < REFINEMENT && jumped, "{taken} in frame {frame} of {stretch:?} after {before:?}");
                }
            }
            before = Some(*stretch);
        }
        prop_assert_eq!(levels.len(), 1, "it hunts: {:?}", levels);
        let last = levels.pop_last().expect("there were frames");
        // A fit level is sure to fit if the frame by the sums, the largest cost of the model and the margin for jumps fit
        // into the usable time. With a contact, the frame by the sums is uncertain by the spread of the model's cost.
        let usable = Budget::usable(DEADLINE);
        let sure = |fit_level: FitLevel| {
            let blur = if contact { Budget::model_cycles(fit_level.lower()) } else { [0, 0] };
            rest + 100 + blur[0] - blur[1] + most(fit_level) <= usable - usable / 32
        };
        let reached = (1..=asked as u8).map(FitLevel::from_number).take_while(|fit_level| sure(*fit_level)).last();
        prop_assert!(last >= reached.unwrap_or(FitLevel::Sum), "{last:?}, but {reached:?} fits");
    }
}

// The budget frame by frame: when the fit level falls, when it rises, and how long it waits.

/// Deadline of a frame, core cycles; [`USABLE`] is seven eighths of it.
const TICKS: u32 = 32_000;
const USABLE: u32 = 28_000;
/// Ticks that must be free before the level rises.
const ROOM: u32 = USABLE / 32;

/// At a fit level, with nothing measured yet, which holds nothing back.
fn at(fit_level: FitLevel) -> Budget {
    let mut budget = Budget::new();
    assert_eq!(next(&mut budget, fit_level, 0), fit_level);
    budget
}

/// Fit level of the next frame after one that took so many cycles.
fn next(budget: &mut Budget, asked: FitLevel, taken: u32) -> FitLevel {
    budget.next(asked, CoreCycles(taken), CoreCycles(TICKS))
}

fn most(fit_level: FitLevel) -> u32 {
    Budget::model_cycles(fit_level)[0]
}

/// Frames until the fit level changes, at most `at_most`.
fn frames_to_change(budget: &mut Budget, asked: FitLevel, taken: u32, at_most: u32) -> Option<(u32, FitLevel)> {
    let before = next(budget, asked, taken);
    (2..=at_most).find_map(|frame| {
        let fit_level = next(budget, asked, taken);
        (fit_level != before).then_some((frame, fit_level))
    })
}

/// Without a contact the model's maximum is added to the measured frame time; with one the frame time includes it.
#[test]
fn it_falls_at_once_where_the_dearest_frame_would_not_fit() {
    for fit_level in [FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows, FitLevel::AllRows] {
        for (modelled, longest) in [(false, USABLE - most(fit_level)), (true, USABLE)] {
            let mut budget = at(fit_level);
            budget.note(Some(modelled));
            assert_eq!(next(&mut budget, fit_level, longest), fit_level);
            assert_eq!(next(&mut budget, fit_level, longest + 1), fit_level.lower(), "{fit_level:?}");
        }
    }
}

/// Measured frames with a contact include at least the model's minimum, so the rest is shorter by it.
#[test]
fn it_rises_where_the_next_effort_fits_with_room() {
    let levels = [FitLevel::Sum, FitLevel::Moments, FitLevel::OneRow, FitLevel::TwoRows, FitLevel::FiveRows];
    for (fit_level, contact) in levels.into_iter().flat_map(|fit_level| [(fit_level, false), (fit_level, true)]) {
        let included = if contact { Budget::model_cycles(fit_level)[1] } else { 0 };
        let longest = USABLE - ROOM - most(fit_level.higher()) + included;
        for (taken, rises) in [(longest, Some((WINDOW, fit_level.higher()))), (longest + 1, None)] {
            let mut budget = at(fit_level);
            budget.note(Some(contact));
            let found = frames_to_change(&mut budget, FitLevel::AllRows, taken, 20 * WINDOW);
            assert_eq!(found, rises, "{fit_level:?}, contact {contact}, {taken} cycles");
            // A lower level is used at once.
            assert_eq!(next(&mut budget, FitLevel::Sum, taken), FitLevel::Sum);
        }
    }
}

#[test]
fn one_long_frame_holds_it_back_for_its_window() {
    for long_frame in [1, 7, WINDOW - 1, WINDOW] {
        let mut budget = at(FitLevel::FiveRows);
        let long = USABLE - most(FitLevel::FiveRows);
        for frame in 1..=2 * WINDOW {
            let fit_level = next(&mut budget, FitLevel::AllRows, if frame == long_frame { long } else { 10 });
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
        assert_eq!(budget.next(FitLevel::AllRows, CoreCycles(USABLE), CoreCycles(TICKS)), FitLevel::FiveRows);
        let rises = frames_to_change(&mut budget, FitLevel::AllRows, 10, 2 * WAIT_MAX * WINDOW);
        assert_eq!(rises, Some((wait * WINDOW, FitLevel::AllRows)));
        wait = (2 * wait).min(WAIT_MAX);
    }
    assert_eq!(wait, WAIT_MAX);
    // Another requested level or deadline restarts the budget.
    budget.next(FitLevel::AllRows, CoreCycles(USABLE), CoreCycles(TICKS));
    let rises = frames_to_change(&mut budget, FitLevel::FiveRows, 10, 10 * WINDOW);
    assert_eq!(rises, None, "it has what it asks");
    assert_eq!(frames_to_change(&mut budget, FitLevel::AllRows, 10, 10 * WINDOW), Some((WINDOW, FitLevel::AllRows)));
}

#[test]
fn a_contact_that_comes_or_goes_begins_the_window_anew() {
    for before in [1, 10, WINDOW - 1] {
        let mut budget = at(FitLevel::OneRow);
        for _ in 0..before {
            assert_eq!(budget.next(FitLevel::AllRows, CoreCycles(2_000), CoreCycles(TICKS)), FitLevel::OneRow);
            budget.note(Some(false));
        }
        budget.note(Some(true));
        budget.note(Some(true));
        let rises = frames_to_change(&mut budget, FitLevel::AllRows, 2_000, 3 * WINDOW);
        assert_eq!(rises, Some((WINDOW, FitLevel::TwoRows)), "after {before}");
    }
}

/// By the estimate: a row 1,000 cycles, the solution 1,600, and the start 2,100 where it falls into the same frame.
#[test]
fn the_dearest_frame_is_the_last_rows_with_the_solution() {
    for (fit_level, rows, start) in [
        (FitLevel::OneRow, 1, 0),
        (FitLevel::TwoRows, 2, 0),
        (FitLevel::FiveRows, 5, 0),
        (FitLevel::AllRows, 10, 2_100),
    ] {
        let [most, least] = Budget::model_cycles(fit_level);
        assert_eq!(most, start + 1_000 * rows + 1_600, "{fit_level:?}");
        assert!((most / 4..=most * 3 / 5).contains(&least), "{fit_level:?}: {least}");
    }
    assert_eq!([FitLevel::Sum, FitLevel::Moments].map(Budget::model_cycles), [[0; 2]; 2]);
}

/// Frames that are too long even by the sum are no falls: nothing has to be waited for after them.
#[test]
fn there_is_no_fall_below_the_sum() {
    let mut budget = at(FitLevel::Sum);
    (0..10).for_each(|_| assert_eq!(next(&mut budget, FitLevel::AllRows, TICKS), FitLevel::Sum));
    // The window that they were in, and the next.
    let rises = frames_to_change(&mut budget, FitLevel::AllRows, 10, 10 * WINDOW);
    assert_eq!(rises, Some((2 * WINDOW - 10, FitLevel::Moments)));
}

#[test]
fn the_time_of_a_tare_is_not_weighed() {
    let mut budget = at(FitLevel::OneRow);
    let mut next = |modelled| {
        budget.note(modelled);
        budget.next(FitLevel::OneRow, CoreCycles(TICKS), CoreCycles(TICKS))
    };
    for _ in 0..3 * WINDOW {
        assert_eq!(next(None), FitLevel::OneRow);
    }
    assert!(next(Some(true)) < FitLevel::OneRow, "a frame that is weighed");
}
