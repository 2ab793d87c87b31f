//! A record's bytes.

use super::names::{COUNT, NUMBERS, gains_number, gains_stand_apart};
use super::{CRC, Record};
use crate::pressure::Gains;

const MAGIC: [u8; 4] = *b"FTPR";
const HEADER_BYTES: usize = 12;
/// More values than this no firmware writes.
const VALUES_MAX: usize = 512;
/// What flash reads after an erase.
pub const BLANK: u8 = 0xFF;
/// Where records may begin: every so many bytes.
pub const GRID: usize = 16;

/// From a record of this firmware whose gains are all 1 to the next one.
pub const SLOT_BYTES: usize = slot_bytes(COUNT);

/// From a record of so many values to the next one.
pub const fn slot_bytes(count: usize) -> usize {
    (HEADER_BYTES + 8 * count + 4).next_multiple_of(GRID)
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// From the longest record of this array to the next one.
    pub const SLOT_MAX: usize = {
        assert!(gains_stand_apart(ROWS, COLUMNS), "the gains' numbers are those of other values: rename one");
        slot_bytes(COUNT + Gains::<ROWS, COLUMNS>::WORDS)
    };

    fn stored_gains(&self) -> usize {
        if self.gains == Gains::ONE { 0 } else { Gains::<ROWS, COLUMNS>::WORDS }
    }

    /// From this record to the next one.
    pub fn slot_bytes(&self) -> usize {
        slot_bytes(COUNT + self.stored_gains())
    }
}

/// A record as it is written to flash, word by word, up to where the next one may begin.
pub fn words<const ROWS: usize, const COLUMNS: usize>(
    record: &Record<ROWS, COLUMNS>,
    sequence: u32,
) -> impl Iterator<Item = u32> {
    let (gains, length) = (record.stored_gains(), record.slot_bytes() / 4);
    let header = [u32::from_le_bytes(MAGIC), sequence, (COUNT + gains) as u32];
    let values = NUMBERS.iter().zip(record.values()).flat_map(|(number, value)| [*number, value as u32]);
    let first = const { gains_number(ROWS, COLUMNS) };
    let gains = (0..gains).flat_map(move |word| [first.wrapping_add(word as u32), record.gains.word(word)]);
    let body = header.into_iter().chain(values).chain(gains);
    let mut check = CRC.digest();
    body.clone().for_each(|word| check.update(&word.to_le_bytes()));
    body.chain([check.finalize()]).chain(core::iter::repeat(u32::from_le_bytes([BLANK; 4]))).take(length)
}

/// A whole record in flash.
#[derive(Clone, Copy)]
pub struct Found<'a> {
    /// Number of the record: each is one more than the one before.
    pub sequence: u32,
    /// From its start to where the next may begin.
    pub bytes: usize,
    values: &'a [[u8; 8]],
}

impl Found<'_> {
    /// Numbers and values.
    pub fn values(&self) -> impl Iterator<Item = (u32, i32)> {
        self.values
            .iter()
            .map(|&[a, b, c, d, e, f, g, h]| (u32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h])))
    }
}

/// The record that begins here, if one does and is whole.
pub fn read(bytes: &[u8]) -> Option<Found<'_>> {
    let (header, rest) = bytes.split_first_chunk::<HEADER_BYTES>()?;
    let [magic, sequence, count] = *header.as_chunks().0 else { return None };
    let count = u32::from_le_bytes(count) as usize;
    if magic != MAGIC || count > VALUES_MAX {
        return None;
    }
    let (values, check) = rest.split_at_checked(8 * count)?;
    let body = bytes.get(..HEADER_BYTES + values.len())?;
    let whole = check.first_chunk() == Some(&CRC.checksum(body).to_le_bytes());
    let values = values.as_chunks().0;
    whole.then_some(Found { sequence: u32::from_le_bytes(sequence), bytes: slot_bytes(count), values })
}

/// Where the last thing in the sector ends: all behind it is blank.
pub fn end(sector: &[u8]) -> usize {
    let used = sector.chunks_exact(GRID).rposition(|chunk| {
        let (words, _) = chunk.as_chunks::<4>();
        words.iter().any(|word| *word != [BLANK; 4])
    });
    used.map_or(0, |place| (place + 1) * GRID)
}
