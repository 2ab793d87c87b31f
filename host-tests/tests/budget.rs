//! The budget of the loop's time, against any way in which frames may take time.

use fingertip::contact::FitLevel;
use fingertip::pipeline::budget::{WAIT_MAX, WINDOW};
use fingertip::shipped::Budget;
use fingertip::units::CoreCycles;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Three quarters of a frame at 10 kHz, ticks.
const DEADLINE: u32 = 12_568;

/// Frames of the longest refinement, of which only one is the dearest, and one more.
const REFINEMENT: u32 = 12;

/// How long frames take: `rest`, up to `spread` more, and with a contact what the fit level takes, from its least at a
/// `model_q8` of 0 to its most at 256.
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

/// A loop that takes time.
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
            // The dearest frame is one of several, which come in turn; the others take a part.
            self.turn = (self.turn + 1) % (REFINEMENT - 1);
            self.taken +=
                (least + (((most - least) * with.model_q8) >> 8)) * (REFINEMENT - 1 - self.turn) / (REFINEMENT - 1);
        }
        self.budget.note(with.contact && most > 0);
        (fit_level, self.taken)
    }
}

/// What a loop can be sure to keep: the frame by the sums, the model's most, and the margin for what jumps.
fn fits(fit_level: FitLevel, rest: u32) -> bool {
    let usable = Budget::usable(DEADLINE);
    rest + Budget::model_cycles(fit_level)[0] <= usable - usable / 32
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 400,
        rng_seed: RngSeed::Fixed(2003),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn a_deadline_is_missed_only_where_the_rest_jumps_by_more_than_the_margin(
        asked in 0..6_u8,
        stretches in proptest::collection::vec(stretch(), 1..12),
    ) {
        let mut running = Loop::new();
        let asked = FitLevel::from_number(asked);
        let margin = DEADLINE - Budget::usable(DEADLINE);
        let mut before = None;
        for stretch in &stretches {
            for frame in 0..stretch.frames {
                let (fit_level, taken) = running.frame(asked, DEADLINE, stretch);
                prop_assert!(fit_level <= asked);
                // What was measured last tells all but a jump of the rest and of the contact.
                let jumped = before.is_none_or(|before: Stretch| stretch.rest + stretch.spread > before.rest + margin);
                if taken > DEADLINE {
                    prop_assert!(frame < REFINEMENT && jumped, "{taken} in frame {frame} of {stretch:?} after {before:?}");
                }
            }
            before = Some(*stretch);
        }
    }

    #[test]
    fn where_there_is_room_the_effort_comes_back_and_stays(
        asked in 1..6_u8,
        stretches in proptest::collection::vec(stretch(), 0..6),
        rest in 1_000..9_000_u32,
        contact in prop::bool::ANY,
    ) {
        let mut running = Loop::new();
        let asked = FitLevel::from_number(asked);
        for stretch in &stretches {
            for _ in 0..stretch.frames {
                running.frame(asked, DEADLINE, stretch);
            }
        }
        // Long enough for the longest wait.
        let calm = Stretch { frames: (WAIT_MAX + 12) * WINDOW, rest, spread: 100, contact, model_q8: 256 };
        let mut changes = 0;
        let mut last = None;
        for frame in 0..2 * calm.frames {
            let (fit_level, taken) = running.frame(asked, DEADLINE, &calm);
            changes += u32::from(frame >= calm.frames && last.is_some_and(|last| last != fit_level));
            last = Some(fit_level);
            prop_assert!(frame < REFINEMENT || taken <= DEADLINE, "{taken} in frame {frame}");
        }
        prop_assert_eq!(changes, 0, "it hunts");
        let last = last.expect("there were frames");
        // With a contact the rest is known less well: by what a window's dearest frame may take for the model more than
        // its least.
        let sure = |fit_level: FitLevel| {
            let blur = if contact { Budget::model_cycles(fit_level.lower()) } else { [0, 0] };
            fits(fit_level, rest + 100 + blur[0] - blur[1])
        };
        let reached = (1..=asked as u8).map(FitLevel::from_number).take_while(|fit_level| sure(*fit_level)).last();
        prop_assert!(last >= reached.unwrap_or(FitLevel::Sum), "{last:?}, but {reached:?} fits");
    }
}

#[test]
fn a_model_dearer_than_estimated_is_tried_ever_less_often() {
    // Half as dear again: what fits by the estimate does not.
    let dear = Stretch { frames: 0, rest: 6_000, spread: 0, contact: true, model_q8: 384 };
    let mut running = Loop::new();
    let mut rises = [0; 2];
    let mut last = FitLevel::Sum;
    for rises in &mut rises {
        for _ in 0..20 * WAIT_MAX * WINDOW {
            let (fit_level, taken) = running.frame(FitLevel::AllRows, DEADLINE, &dear);
            assert!(taken <= DEADLINE, "{taken} with {fit_level:?}");
            *rises += u32::from(fit_level > last);
            last = fit_level;
        }
    }
    // Once in the longest wait at most.
    assert!(rises[1] <= 21 && rises[0] <= rises[1] + 12, "{rises:?}");
}

#[test]
fn what_is_not_measured_is_not_held_back() {
    let mut budget = Budget::new();
    for fit_level in FitLevel::ALL.into_iter().chain(FitLevel::ALL.into_iter().rev()) {
        assert_eq!(budget.next(fit_level, CoreCycles(0), CoreCycles(DEADLINE)), fit_level);
    }
}

#[test]
fn a_contact_out_of_nothing_finds_an_effort_that_fits() {
    // Without a contact every fit level is cheap; the first frame with one must fit all the same.
    for rest in (1_000..9_000).step_by(250) {
        let mut running = Loop::new();
        let still = Stretch { frames: 0, rest, spread: 0, contact: false, model_q8: 256 };
        for _ in 0..100 * WINDOW {
            running.frame(FitLevel::AllRows, DEADLINE, &still);
        }
        for _ in 0..1_000 {
            let (fit_level, taken) = running.frame(FitLevel::AllRows, DEADLINE, &Stretch { contact: true, ..still });
            assert!(taken <= DEADLINE, "{taken} with {fit_level:?}");
        }
    }
}
