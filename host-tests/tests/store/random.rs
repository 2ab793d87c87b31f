//! Random saves, losses of power and starts, beside a board's memory of what it should hold.

use crate::nor::{Board, Cut, Nor, RESTS, record};
use fingertip::store::{Flash as _, Journal, SLOT_BYTES, SaveError, Sector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// What happens next.
#[derive(Clone, Debug)]
enum Step {
    /// A start with power to spare, and so many saves.
    Live(usize),
    /// A start whose power ends at a word, and saves.
    Dies(Cut),
}

fn step(words: usize) -> impl Strategy<Value = Step> {
    let dies = (0..160usize, any::<u32>(), 0..=words, 0..4usize, any::<u64>(), any::<bool>()).prop_map(
        |(after, undone, words, rest, seed, none)| {
            let after = if none { 0 } else { after };
            Step::Dies(Cut { after, undone, words, rest: RESTS[rest], seed })
        },
    );
    prop_oneof![(0..8usize).prop_map(Step::Live), dies]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000, rng_seed: RngSeed::Fixed(22), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn a_board_has_the_old_values_or_the_new_ones(
        slots in 4..7usize,
        odd in 0..SLOT_BYTES / 16,
        steps in prop::collection::vec(step(6 * SLOT_BYTES / 4), 1..40),
    ) {
        // Sectors of a whole number of records, and of a part more.
        let mut board = Board::new(Nor::blank(slots * SLOT_BYTES + 16 * odd), None);
        let mut number = 0;
        for step in steps {
            let (cut, saves) = match step {
                Step::Live(saves) => (None, saves),
                Step::Dies(cut) => (Some(cut), 3),
            };
            board.start(cut);
            for place in 0..saves {
                number += 1;
                match board.save(record(number)) {
                    // A start makes room for one at the least.
                    Err(SaveError::Full) => prop_assert!(place > 0),
                    Err(_) => prop_assert!(!board.nor.powered),
                    Ok(()) => prop_assert_eq!(board.kept, Some(record(number))),
                }
            }
        }
        board.start(None);
    }

    #[test]
    fn no_bytes_make_it_fail(
        a in prop::collection::vec(any::<u8>(), 0..600), b in prop::collection::vec(any::<u8>(), 0..600), magic in 0..500usize,
    ) {
        let whole = |mut bytes: Vec<u8>| {
            bytes.resize(bytes.len().next_multiple_of(16), 0xFF);
            bytes
        };
        let mut nor = Nor::new([whole(a), whole(b)]);
        let a = nor.sector(Sector::A);
        let place = magic / 16 * 16;
        if let Some(place) = a.get_mut(place..place + 4) {
            place.copy_from_slice(b"FTPR");
        }
        let mut journal = Journal::new(&nor);
        let loaded = journal.load(&nor, |_| ());
        prop_assert_eq!(loaded.record, fingertip::shipped::Record::DEFAULT);
        prop_assert_eq!(loaded.sound, [Sector::A, Sector::B].iter().all(|sector| nor.bytes(*sector).iter().all(|byte| *byte == 0xFF)));
        let _ = journal.make_room(&mut nor, SLOT_BYTES);
        let _ = journal.save(&mut nor, &record(1), || ());
    }
}
