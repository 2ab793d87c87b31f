//! Order of writing and erasing, so that at every instant one sector holds the newest whole record.
//!
//! - A save appends to the sector of the newest record; if that is full, to the other one, once that was erased.
//! - A start whose sector is nearly full erases the other one if that has older records. The sector with the newest
//!   whole record is never erased.
//! - Damaged bytes behind the newest whole record were written after it, and so were damaged bytes in the other
//!   sector if the newest one's is full. Each start reports them until the next save, which is written behind them.
//!   An erase that was cut short at such a time looks the same, and is reported too.

use super::{BLANK, Found, GRID, Record, Remark, read_record, take, words};

/// One of the two sectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sector {
    /// Sector that a new board uses first.
    A,
    /// The other sector.
    B,
}

impl Sector {
    /// Returns the other sector.
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Two sectors of flash: programming clears bits, erasing sets all bits of a sector.
pub trait Flash {
    /// Reason of a failure.
    type Error;

    /// The bytes of a sector, a multiple of 16.
    fn bytes(&self, sector: Sector) -> &[u8];

    /// Programs a blank word, unless the flash refuses.
    fn program(&mut self, sector: Sector, offset: usize, word: u32) -> Result<(), Self::Error>;

    /// Erases a sector, unless the flash refuses.
    fn erase(&mut self, sector: Sector) -> Result<(), Self::Error>;
}

/// Reason why a record was not saved, or no room made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError<E> {
    /// Both sectors are full; the next start erases one.
    Full,
    /// The flash refuses.
    Flash(E),
    /// The flash reads back something else.
    Verify,
}

/// Result of loading the parameters at a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded<const ROWS: usize, const COLUMNS: usize> {
    /// The newest whole record, or the defaults.
    pub record: Record<ROWS, COLUMNS>,
    /// True if nothing was lost or refused.
    pub sound: bool,
}

/// Positions of the records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Journal {
    /// Current sector for saves: that of the newest whole record.
    current: Sector,
    /// Positions in the current sector, and in the other one.
    sectors: [SectorContent; 2],
}

impl Journal {
    /// Reads the positions from the flash.
    pub fn new(flash: &impl Flash) -> Self {
        let [a, b] = [Sector::A, Sector::B].map(|sector| SectorContent::of(flash.bytes(sector)));
        let b_is_newer = match (a.newest, b.newest) {
            (Some(a), Some(b)) => b.sequence.wrapping_sub(a.sequence).cast_signed() > 0,
            (a, b) => a.is_none() && b.is_some(),
        };
        let (current, sectors) = if b_is_newer { (Sector::B, [b, a]) } else { (Sector::A, [a, b]) };
        Self { current, sectors }
    }

    /// Loads the newest whole record, as far as this firmware can take it. `tell` is called with every remark.
    #[inline(never)]
    pub fn load<const ROWS: usize, const COLUMNS: usize>(
        &self,
        flash: &impl Flash,
        mut tell: impl FnMut(Remark),
    ) -> Loaded<ROWS, COLUMNS> {
        let [own, other] = self.sectors;
        let bytes = flash.bytes(self.current);
        let found = own.newest.and_then(|whole| Some((whole, read_record(bytes.get(whole.start..)?)?)));
        let Some((whole, found)) = found else {
            let blank = own.end == 0 && other.end == 0;
            if !blank {
                tell(Remark::NoneWhole);
            }
            return Loaded { record: Record::DEFAULT, sound: blank };
        };
        // A save goes to the other sector only if there is no room behind the newest record, and the other one was
        // erased. The record that was to be saved may have been longer or shorter than that.
        let room = bytes.len().saturating_sub(whole.end) >= Record::<ROWS, COLUMNS>::SLOT_MAX;
        let torn = own.end > whole.end || (!room && other.newest.is_none() && other.end > 0);
        if torn {
            tell(Remark::Torn);
        }
        let (record, taken) = take(&found, tell);
        Loaded { record, sound: taken && !torn }
    }

    /// Erases the sector without the newest whole record if both are nearly full, or have no room for a record of
    /// `slot_max` bytes. Returns true if it did. For the start: the core may halt for seconds. Fails if the flash
    /// refuses, or is not blank afterwards.
    pub fn make_room<F: Flash>(&mut self, flash: &mut F, slot_max: usize) -> Result<bool, SaveError<F::Error>> {
        let [own, other] = self.sectors;
        let low = |sector, content: SectorContent| {
            let size = flash.bytes(sector).len();
            size.saturating_sub(content.end) < (size / 4).max(slot_max)
        };
        let erased = self.current.other();
        if !low(self.current, own) || (other.newest.is_none() && !low(erased, other)) {
            return Ok(false);
        }
        flash.erase(erased).map_err(SaveError::Flash)?;
        let content = SectorContent::of(flash.bytes(erased));
        self.sectors = [own, content];
        if content.end == 0 { Ok(true) } else { Err(SaveError::Verify) }
    }

    /// Appends a record, a word at a time; `between` is called before each, to feed a watchdog for example. Fails if
    /// the sectors are full, or the flash does not hold the record afterwards.
    #[inline(never)]
    pub fn save<const ROWS: usize, const COLUMNS: usize, F: Flash>(
        &mut self,
        flash: &mut F,
        record: &Record<ROWS, COLUMNS>,
        between: impl FnMut(),
    ) -> Result<(), SaveError<F::Error>> {
        let [own, other] = self.sectors;
        let (length, sequence) = (record.slot_bytes(), own.newest.map_or(0, |newest| newest.sequence).wrapping_add(1));
        let room = |sector, content: SectorContent| flash.bytes(sector).len().saturating_sub(content.end) >= length;
        if !room(self.current, own) {
            if other.newest.is_some() || !room(self.current.other(), other) {
                return Err(SaveError::Full);
            }
            self.current = self.current.other();
            self.sectors = [other, own];
        }
        let start = self.sectors[0].end;
        let written = write(flash, self.current, start, || words(record, sequence), between);
        if written.is_ok() {
            let end = start + length;
            self.sectors[0] = SectorContent { end, newest: Some(Whole { start, end, sequence }) };
        } else {
            // Whatever the result, the next record goes behind it.
            *self = Self::new(flash);
        }
        written
    }
}

fn write<F: Flash, W: Iterator<Item = u32>>(
    flash: &mut F,
    sector: Sector,
    start: usize,
    words: impl Fn() -> W,
    mut between: impl FnMut(),
) -> Result<(), SaveError<F::Error>> {
    for (place, word) in words().enumerate() {
        between();
        if word.to_le_bytes() != [BLANK; 4] {
            flash.program(sector, start + 4 * place, word).map_err(SaveError::Flash)?;
        }
    }
    let held = flash.bytes(sector).get(start..).unwrap_or_default().as_chunks().0;
    let mut held = held.iter().map(|held| u32::from_le_bytes(*held));
    if words().all(|word| held.next() == Some(word)) { Ok(()) } else { Err(SaveError::Verify) }
}

/// Content of a sector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct SectorContent {
    /// Offset behind which all bytes are blank.
    end: usize,
    /// Last whole record.
    newest: Option<Whole>,
}

/// A whole record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Whole {
    start: usize,
    end: usize,
    sequence: u32,
}

impl SectorContent {
    fn of(sector: &[u8]) -> Self {
        // Word by word: the start reads two sectors, and a comparison of whole chunks goes byte by byte.
        let used = sector.as_chunks::<4>().0.iter().rposition(|word| *word != [BLANK; 4]);
        let end = used.map_or(0, |place| (4 * place / GRID + 1) * GRID);
        let newest = (0..end / GRID).rev().map(|place| place * GRID).find_map(|start| {
            let Found { sequence, bytes, .. } = read_record(sector.get(start..)?)?;
            Some(Whole { start, end: start + bytes, sequence })
        });
        Self { end: newest.map_or(end, |newest| newest.end.max(end)), newest }
    }
}
