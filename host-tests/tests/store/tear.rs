//! Power lost at every word of a save and of an erase, twice in a row, from every state that the sectors may be in.

use super::{OTHERS, Other};
use crate::common::*;
use fingertip::shipped::{Loaded, Record};
use fingertip::store::{Flash, Journal, SLOT_BYTES, SaveError, Sector};
use sim::encode;

/// Slots of a small sector.
const SLOTS: usize = 5;
const SIZE: usize = SLOTS * SLOT_BYTES;

/// A sector with records of another firmware, or of this one.
fn sector(size: usize, count: usize, first: i32, other: Other) -> (Vec<u8>, Option<Record>) {
    let (mut bytes, mut newest) = (Vec::new(), None);
    for number in first..first + count as i32 {
        let (record, expected) = other.record(number, number as u32);
        if bytes.len() + record.len() > size {
            break;
        }
        bytes.extend(record);
        newest = Some(expected);
    }
    bytes.resize(size, 0xFF);
    (bytes, newest)
}

/// Every place at which an operation can be cut; of an erase one word in `few`.
fn cuts(done: &[Done], words: usize, few: usize) -> Vec<Cut> {
    let mut cuts = Vec::new();
    for (after, kind) in done.iter().enumerate() {
        let seed = after as u64;
        let cut = Cut { after, undone: 0, words: 0, rest: Rest::Old, seed };
        match kind {
            Done::Word => {
                cuts.extend([u32::MAX, 0, bits(seed), bits(seed + 999)].map(|undone| Cut { undone, ..cut }));
            }
            Done::Erase => {
                for words in (0..=words).step_by(few) {
                    cuts.extend(RESTS.map(|rest| Cut { words, rest, ..cut }));
                }
            }
        }
    }
    cuts
}

/// Cuts a save of one record at every place, of an erase at one word in `few`. The board then starts twice, with the old
/// record or the new one, and saves another one. Returns the number of cuts, and whether there was an erase.
fn torn(board: &Board, [next, other]: [Record; 2], words: usize, few: usize) -> (usize, bool) {
    let mut whole = board.clone();
    whole.start(None);
    assert_eq!(whole.save(next), Ok(()));
    let cuts = cuts(&whole.nor.done, words, few);
    for cut in &cuts {
        let mut torn = board.clone();
        torn.start(Some(*cut));
        let _ = torn.save(next);
        torn.start(None);
        torn.start(None);
        assert_eq!(torn.save(other), Ok(()), "{cut:?}");
        torn.start(None);
    }
    (cuts.len(), whole.nor.done.contains(&Done::Erase))
}

#[test]
fn sectors_of_the_real_size_are_torn_too() {
    const SIZE: usize = 128 << 10;
    let slots = SIZE / SLOT_BYTES;
    let mut cases = 0;
    // The newest is nearly full, then full, with the other one older.
    for count in [slots - 1, slots] {
        let (older, _) = sector(SIZE, slots, 1_000 - slots as i32, Other::None);
        let (newer, newest) = sector(SIZE, count, 1_000, Other::None);
        let board = Board::new(Nor::new([older, newer]), newest);
        let (cuts, erased) = torn(&board, [3_000, 3_001].map(record), SIZE / 4, 501);
        assert!(erased, "room for less than a quarter is made");
        cases += cuts;
    }
    assert!(cases > 1_000, "{cases} cases");
}

/// Wherever power is cut, the next start loads one complete record with or without gains, the old or the new one.
#[test]
fn gains_torn_anywhere_are_the_old_ones_or_the_new_ones() {
    let size = 4 * Record::SLOT_MAX;
    let made = |number: i32| if number % 3 == 0 { record(number) } else { with_gains(number) };
    let mut cases = 0;
    for count in 0..12 {
        let mut board = Board::new(Nor::blank(size), None);
        board.slot = Record::SLOT_MAX;
        for number in 0..count {
            board.start(None);
            assert_eq!(board.save(made(number)), Ok(()));
        }
        cases += torn(&board, [made(count), with_gains(100)], size / 4, 61).0;
    }
    assert!(cases > 4_000, "{cases} cases");
}

#[test]
fn nobody_erases_the_newest_record_while_a_board_lives() {
    let mut board = Board::new(Nor::blank(SIZE), None);
    let mut erases = 0;
    for number in 0..200 {
        board.start(None);
        erases += board.nor.done.iter().filter(|done| **done == Done::Erase).count();
        assert_eq!(board.save(record(number)), Ok(()));
        let newest = encode(&record(number), number as u32 + 1);
        let holds = |sector: &Vec<u8>| sector.windows(SLOT_BYTES).step_by(16).any(|place| place == newest);
        assert!(board.nor.sectors.iter().any(holds));
    }
    assert!((30..=45).contains(&erases), "{erases} erases in 200 saves, not one in {SLOTS}");
}

/// Next event.
#[derive(Clone, Debug)]
enum Step {
    /// A start with power to spare, and the given number of saves.
    Live(usize),
    /// A start whose power ends at a word, and saves.
    Dies(Cut),
}

fn step(words: usize) -> impl Strategy<Value = Step> {
    let undone = prop_oneof![1 => Just(0), 1 => Just(u32::MAX), 2 => any::<u32>()];
    let dies = (0..160usize, undone, 0..=words, 0..4usize, any::<u64>(), any::<bool>()).prop_map(
        |(after, undone, words, rest, seed, none)| {
            let after = if none { 0 } else { after };
            Step::Dies(Cut { after, undone, words, rest: RESTS[rest], seed })
        },
    );
    prop_oneof![(0..8usize).prop_map(Step::Live), dies]
}

sim::sizes!(a_board_has_the_old_values_or_the_new_ones, live(500), live(60_000));

/// Boards with records of any firmware in both sectors, which start, save and lose their power.
fn live(boards: u32) {
    let counts = [0..8_usize, 0..8_usize];
    let steps = prop::collection::vec(step(6 * SLOT_BYTES / 4), 1..40);
    let inputs = (4..7_usize, 0..SLOT_BYTES / 16, 0..OTHERS.len(), counts, any::<bool>(), steps);
    let outcome = TestRunner::new(seeded(boards, 22)).run(&inputs, |(slots, odd, other, counts, swapped, steps)| {
        // Sectors of a whole number of records, and of a part more.
        let size = slots * SLOT_BYTES + 16 * odd;
        let (older, old) = sector(size, counts[0], 1, OTHERS[other]);
        let (newer, newest) = sector(size, counts[1], 50, OTHERS[other]);
        let sectors = if swapped { [newer, older] } else { [older, newer] };
        let mut board = Board::new(Nor::new(sectors), newest.or(old));
        let mut number = 100;
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
        Ok(())
    });
    outcome.expect("the old values or the new ones");
}

proptest! {
    #![proptest_config(seeded(2000, 22))]

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

// Two sectors of flash that lose power, and the start and the save of a board on them. Programming only clears bits of
// blank words, and a cut leaves any of them undone; erasing sets all bits of a sector, and a cut leaves any mixture:
// see [`Cut`].

/// A record that another pitch does not make.
pub fn record(number: i32) -> Record {
    let params = Params { pitch_um: 500 + number, ..Params::DEFAULT };
    Record { id: (number % 253) as u8, baud_code: 4, return_delay_2us: 7, params, ..Record::DEFAULT }
}

/// The same with gains that no other number has, in every taxel.
pub fn with_gains(number: i32) -> Record {
    let mut record = record(number);
    for place in 0..TAXELS {
        assert!(record.gains.set(place, 8_192 + (131 * place as u16).wrapping_add(7 * number as u16) % 24_000));
    }
    record
}

/// Bits without a pattern, the same in every run.
pub fn bits(seed: u64) -> u32 {
    Rng::with_seed(seed).u32(..)
}

/// Operation in which the power is lost, by its number, and the result of that operation.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Number of whole operations before it.
    pub after: usize,
    /// Of a word: these bits stay as they were.
    pub undone: u32,
    /// Of an erase: number of erased words; the next word has some of its bits set.
    pub words: usize,
    /// Content of the remaining words after an erase was cut.
    pub rest: Rest,
    /// Seed of the random words.
    pub seed: u64,
}

/// Content of the words that an interrupted erase did not reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    Old,
    /// Erased too, but the words before are unchanged: an erase in reverse order.
    Behind,
    /// Some bits are set.
    Weak,
    Random,
}

pub const RESTS: [Rest; 4] = [Rest::Old, Rest::Behind, Rest::Weak, Rest::Random];

/// Operation of the board on the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    Word,
    Erase,
}

#[derive(Clone, Debug)]
pub struct Nor {
    sectors: [Vec<u8>; 2],
    cut: Option<Cut>,
    pub done: Vec<Done>,
    pub powered: bool,
    /// Bits of a record that was begun have changed.
    pub touched: bool,
}

#[derive(Debug, PartialEq, Eq)]
pub struct Lost;

impl Nor {
    pub fn new(sectors: [Vec<u8>; 2]) -> Self {
        Self { sectors, cut: None, done: Vec::new(), powered: true, touched: false }
    }

    pub fn blank(size: usize) -> Self {
        Self::new([vec![0xFF; size], vec![0xFF; size]])
    }

    pub fn sector(&mut self, sector: Sector) -> &mut Vec<u8> {
        &mut self.sectors[sector as usize]
    }

    /// Turns power on, with the next cut.
    pub fn power_on(&mut self, cut: Option<Cut>) {
        (self.cut, self.powered) = (cut, true);
        self.done.clear();
    }

    /// Counts the next operation; returns the cut if the power fails in it, an error if it failed before.
    fn next(&mut self, kind: Done) -> Result<Option<Cut>, Lost> {
        if !self.powered {
            return Err(Lost);
        }
        let cut = self.cut.filter(|cut| cut.after == self.done.len());
        self.done.push(kind);
        self.powered = cut.is_none();
        Ok(cut)
    }
}

fn end(cut: Option<Cut>) -> Result<(), Lost> {
    cut.map_or(Ok(()), |_| Err(Lost))
}

impl Flash for Nor {
    type Error = Lost;

    fn bytes(&self, sector: Sector) -> &[u8] {
        &self.sectors[sector as usize]
    }

    fn program(&mut self, sector: Sector, offset: usize, word: u32) -> Result<(), Lost> {
        let cut = self.next(Done::Word)?;
        let place: &mut [u8; 4] = (&mut self.sectors[sector as usize][offset..offset + 4]).try_into().expect("a word");
        assert_eq!(*place, [0xFF; 4], "a word is programmed once");
        let word = word | cut.map_or(0, |cut| cut.undone);
        self.touched |= word != u32::MAX;
        *place = word.to_le_bytes();
        end(cut)
    }

    fn erase(&mut self, sector: Sector) -> Result<(), Lost> {
        let cut = self.next(Done::Erase)?;
        for (place, word) in self.sectors[sector as usize].chunks_exact_mut(4).enumerate() {
            let old = u32::from_le_bytes((&*word).try_into().expect("a word"));
            let some = |place: usize, seed| bits(seed ^ (place as u64) << 32);
            let now = match cut {
                None => u32::MAX,
                Some(Cut { words, rest: Rest::Behind, .. }) if place != words => {
                    [old, u32::MAX][usize::from(place > words)]
                }
                Some(Cut { words, .. }) if place < words => u32::MAX,
                Some(Cut { words, rest: Rest::Weak, seed, .. }) if place > words => old | some(place, seed),
                Some(Cut { words, rest: Rest::Random, seed, .. }) if place > words => some(place, seed),
                Some(Cut { words, seed, .. }) if place == words => old | some(place, seed),
                Some(_) => old,
            };
            word.copy_from_slice(&now.to_le_bytes());
        }
        end(cut)
    }
}

/// A board with this flash, and the records that the flash should hold.
#[derive(Clone, Debug)]
pub struct Board {
    pub nor: Nor,
    journal: Journal,
    /// The longest record that it saves.
    pub slot: usize,
    /// The newest record that is known to be whole.
    pub kept: Option<Record>,
    /// The record that was being saved when the power was lost.
    tried: Option<Record>,
    /// True if a save that was cut short has left something.
    trace: bool,
    /// True if a start reported that, and erased a sector.
    told: bool,
    /// True if an erase was cut short, since the last whole one.
    erase_torn: bool,
}

impl Board {
    pub fn new(nor: Nor, kept: Option<Record>) -> Self {
        let journal = Journal::new(&nor);
        Self { nor, journal, slot: SLOT_BYTES, kept, tried: None, trace: false, told: false, erase_torn: false }
    }

    /// Starts like the board: it has the old or the new values, and a fault if the new ones were begun but are missing.
    pub fn start(&mut self, cut: Option<Cut>) {
        self.nor.power_on(cut);
        self.journal = Journal::new(&self.nor);
        let Loaded { record, sound } = self.journal.load(&self.nor, |_| ());
        if self.tried == Some(record) {
            (self.kept, self.trace) = (self.tried, false);
        }
        assert_eq!(record, self.kept.unwrap_or_default(), "neither old nor new");
        assert!(!self.trace || !sound || self.told, "the new values are lost without a word");
        assert!(self.trace || sound || self.erase_torn, "a fault although nothing was lost");
        self.tried = None;
        let made = self.journal.make_room(&mut self.nor, self.slot);
        if self.nor.done.contains(&Done::Erase) {
            self.erase_torn = !self.nor.powered;
            // The words that showed it may be erased by now.
            self.told = !sound;
        }
        assert!(made.is_ok() == self.nor.powered, "{made:?}");
    }

    /// Saves a record, if there is power still.
    pub fn save(&mut self, record: Record) -> Result<(), SaveError<Lost>> {
        if !self.nor.powered {
            return Err(SaveError::Flash(Lost));
        }
        self.nor.touched = false;
        let saved = self.journal.save(&mut self.nor, &record, || ());
        match saved {
            Ok(()) => (self.kept, self.trace, self.told) = (Some(record), false, false),
            Err(SaveError::Full) => {}
            Err(_) => {
                self.tried = Some(record);
                self.trace |= self.nor.touched;
                self.told &= !self.nor.touched;
            }
        }
        saved
    }
}
