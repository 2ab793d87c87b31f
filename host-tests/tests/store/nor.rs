//! Two sectors of flash that lose power, and the start and the save of a board on them.
//!
//! Programming only clears bits, of words that are blank; erasing sets all bits of a sector. A loss of power leaves of
//! the word that was programmed any of its bits undone, and of an erase any mixture: see [`Cut`].

use fingertip::params::Params;
use fingertip::shipped::{Loaded, Record, TAXELS};
use fingertip::store::{Flash, Journal, SLOT_BYTES, SaveError, Sector};

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

/// SplitMix64: the same bits in every run.
pub fn bits(seed: u64) -> u32 {
    let mut mixed = seed.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (mixed ^ mixed >> 31) as u32
}

/// Where the power is lost, counted in operations, and what is left of that one.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// So many operations are whole before it.
    pub after: usize,
    /// Of a word: these bits stay as they were.
    pub undone: u32,
    /// Of an erase: so many words are erased; the next one has some of its bits set.
    pub words: usize,
    /// Of an erase: what the other words are.
    pub rest: Rest,
    /// For what is random.
    pub seed: u64,
}

/// What an erase leaves behind the words that it has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// As it was.
    Old,
    /// Erased too, but what comes before is as it was: the other way round.
    Behind,
    /// Some bits are set.
    Weak,
    /// Anything.
    Random,
}

pub const RESTS: [Rest; 4] = [Rest::Old, Rest::Behind, Rest::Weak, Rest::Random];

/// What the board did to the flash.
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

    /// Power comes back; it will be lost again there.
    pub fn power_on(&mut self, cut: Option<Cut>) {
        (self.cut, self.powered) = (cut, true);
        self.done.clear();
    }

    /// What is lost of the next operation, if it is that one; an operation without power is none.
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

/// A board on such a flash, and what its flash should hold.
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
    /// Whether a save that was cut short has left something.
    trace: bool,
    /// Whether a start has told of that, and erased a sector.
    told: bool,
    /// Whether an erase was cut short, since the last whole one.
    erase_torn: bool,
    /// Faults although nothing was lost.
    pub false_alarms: usize,
}

impl Board {
    pub fn new(nor: Nor, kept: Option<Record>) -> Self {
        let journal = Journal::new(&nor);
        Self {
            nor,
            journal,
            slot: SLOT_BYTES,
            kept,
            tried: None,
            trace: false,
            told: false,
            erase_torn: false,
            false_alarms: 0,
        }
    }

    /// Starts as the board does, and checks what comes up: the old values or the new ones, and a fault where the new
    /// ones were begun and are not there.
    pub fn start(&mut self, cut: Option<Cut>) {
        self.nor.power_on(cut);
        self.journal = Journal::new(&self.nor);
        let Loaded { record, sound } = self.journal.load(&self.nor, |_| ());
        if self.tried == Some(record) {
            (self.kept, self.trace) = (self.tried, false);
        }
        assert_eq!(record, self.kept.unwrap_or_default(), "neither old nor new");
        assert!(!self.trace || !sound || self.told, "the new values are lost without a word");
        if !self.trace && !sound {
            assert!(self.erase_torn, "a fault although nothing was lost");
            self.false_alarms += 1;
        }
        self.tried = None;
        let made = self.journal.make_room(&mut self.nor, self.slot);
        if self.nor.done.contains(&Done::Erase) {
            self.erase_torn = !self.nor.powered;
            // What told it may be erased by now.
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
