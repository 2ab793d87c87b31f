//! Power lost at any word of a save or an erase, again and again, from every state that the sectors may be in.

use super::{OTHERS, Other, record_of};
use crate::common::*;
use fingertip::shipped::{Loaded, Record};
use fingertip::store::{Flash, Journal, SLOT_BYTES, SaveError, Sector};

/// Slots of a small sector.
const SLOTS: usize = 5;
const SIZE: usize = SLOTS * SLOT_BYTES;

/// A sector with records of another firmware, or of this one.
fn sector(size: usize, count: usize, first: i32, other: Other) -> (Vec<u8>, Option<Record>) {
    let (mut bytes, mut newest) = (Vec::new(), None);
    for number in first..first + count as i32 {
        let (record, expected) = record_of(other, number, number as u32);
        if bytes.len() + record.len() > size {
            break;
        }
        bytes.extend(record);
        newest = Some(expected);
    }
    bytes.resize(size, 0xFF);
    (bytes, newest)
}

#[test]
fn a_start_erases_a_sector_only_where_room_is_short() {
    let mut board = Board::new(Nor::blank(SIZE), None);
    let mut erases = 0;
    for number in 0..200 {
        board.start(None);
        erases += board.nor.done.iter().filter(|done| **done == Done::Erase).count();
        assert_eq!(board.save(record(number)), Ok(()));
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

/// Of a board with records and sectors of these bytes: a cut lies within two saves, or in an erase.
fn step(record: usize, sector: usize) -> impl Strategy<Value = Step> {
    let undone = prop_oneof![1 => Just(0), 1 => Just(u32::MAX), 2 => any::<u32>()];
    let dies = (0..record / 3, undone, 0..=sector / 4, 0..4usize, any::<u64>(), any::<bool>()).prop_map(
        |(after, undone, words, rest, seed, none)| {
            let after = if none { 0 } else { after };
            Step::Dies(Cut { after, undone, words, rest: RESTS[rest], seed })
        },
    );
    prop_oneof![(0..8usize).prop_map(Step::Live), dies]
}

sim::sizes!(
    a_board_has_the_old_values_or_the_new_ones,
    (live(500, small), live(60, of_the_real_size)),
    (live(60_000, small), live(2_000, of_the_real_size))
);

/// Bytes of a sector for the longest record: a whole number of records, and a part more.
fn small(longest: usize) -> BoxedStrategy<usize> {
    (4..7_usize, 0..SLOT_BYTES / 16).prop_map(move |(slots, odd)| slots * longest + 16 * odd).boxed()
}

fn of_the_real_size(_: usize) -> BoxedStrategy<usize> {
    Just(128 << 10).boxed()
}

/// Boards with records of any firmware in both sectors, which start, save and lose their power. Of some, most records
/// have gains, so that they differ in length.
fn live(boards: u32, size: fn(usize) -> BoxedStrategy<usize>) {
    let longest = prop::sample::select(&[SLOT_BYTES, Record::SLOT_MAX][..]);
    let sizes = longest.prop_flat_map(move |longest| (Just(longest), size(longest)));
    let lives = sizes
        .prop_flat_map(|(longest, size)| (Just((longest, size)), prop::collection::vec(step(longest, size), 1..40)));
    let inputs = (lives, 0..OTHERS.len(), [0..8_usize, 0..8], any::<bool>());
    let outcome = TestRunner::new(seeded(boards, 22)).run(&inputs, |(life, other, counts, swapped)| {
        let ((longest, size), steps) = life;
        // After a cut comes the longest: the trace of one that was too long for its sector outlasts a shorter one there.
        let made = |number: i32, cut: bool| {
            if longest == SLOT_BYTES || number % 3 == 0 && !cut { record(number) } else { with_gains(number) }
        };
        // A large sector is nearly full.
        let counts = counts.map(|count| count + (size / SLOT_BYTES).saturating_sub(8));
        let (older, old) = sector(size, counts[0], 1, OTHERS[other]);
        let (newer, newest) = sector(size, counts[1], 1_000, OTHERS[other]);
        let sectors = if swapped { [newer, older] } else { [older, newer] };
        let mut board = Board::new(Nor::new(sectors), newest.or(old));
        board.slot = longest;
        let mut number = 2_000;
        for step in steps {
            let (cut, saves) = match step {
                Step::Live(saves) => (None, saves),
                Step::Dies(cut) => (Some(cut), 3),
            };
            board.start(cut);
            for place in 0..saves {
                number += 1;
                let next = made(number, board.trace);
                match board.save(next) {
                    // A start makes room for one at the least.
                    Err(SaveError::Full) => prop_assert!(place > 0),
                    Err(_) => prop_assert!(!board.nor.powered),
                    Ok(()) => prop_assert_eq!(board.kept, Some(next)),
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
        let blank = |sector: &Vec<u8>| sector.iter().rev().take_while(|byte| **byte == 0xFF).count();
        let room = self.nor.sectors.iter().any(|sector| blank(sector) >= sector.len() / 4);
        assert!(made.is_err() || room, "a start leaves less than a quarter of both sectors");
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
