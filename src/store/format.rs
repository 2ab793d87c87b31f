//! A record's bytes.

use super::names::{COUNT, NUMBERS};
use super::{CRC, Record, old};

const MAGIC: [u8; 4] = *b"FTPR";
const HEADER_BYTES: usize = 12;
/// More values than this no firmware writes.
const VALUES_MAX: usize = 256;
/// What flash reads after an erase.
pub const BLANK: u8 = 0xFF;
/// Where records may begin: every so many bytes.
pub const GRID: usize = 16;

/// From this firmware's record to the next one.
pub const SLOT_BYTES: usize = slot_bytes(COUNT);

const fn slot_bytes(count: usize) -> usize {
    (HEADER_BYTES + 8 * count + 4).next_multiple_of(GRID)
}

/// A record as it is written to flash.
pub fn encode(record: &Record, sequence: u32) -> [u8; SLOT_BYTES] {
    let mut slot = [BLANK; SLOT_BYTES];
    let header = [u32::from_le_bytes(MAGIC), sequence, COUNT as u32];
    let values = NUMBERS.iter().zip(record.values()).flat_map(|(number, value)| [*number, value as u32]);
    let words = header.into_iter().chain(values);
    let mut check = CRC.digest();
    let mut places = slot.as_chunks_mut().0.iter_mut();
    for (word, place) in words.zip(places.by_ref()) {
        *place = word.to_le_bytes();
        check.update(place);
    }
    if let Some(place) = places.next() {
        *place = check.finalize().to_le_bytes();
    }
    slot
}

/// A whole record in flash.
#[derive(Clone, Copy)]
pub struct Found<'a> {
    /// None in an old record: any other is newer.
    pub sequence: Option<u32>,
    /// From its start to where the next may begin.
    pub bytes: usize,
    values: Values<'a>,
}

#[derive(Clone, Copy)]
enum Values<'a> {
    Named(&'a [[u8; 8]]),
    Old(&'a [u8; 4], &'a [[u8; 4]]),
}

impl Found<'_> {
    /// Numbers and values.
    pub fn values(&self) -> impl Iterator<Item = (u32, i32)> {
        (0..).map_while(|place| self.values.get(place))
    }
}

impl Values<'_> {
    fn get(&self, place: usize) -> Option<(u32, i32)> {
        match self {
            Self::Named(pairs) => {
                let [a, b, c, d, e, f, g, h] = *pairs.get(place)?;
                Some((u32::from_le_bytes([a, b, c, d]), i32::from_le_bytes([e, f, g, h])))
            }
            Self::Old(head, params) => {
                let value = match head.get(place) {
                    Some(byte) => i32::from(*byte),
                    None => i32::from_le_bytes(*params.get(place - head.len())?),
                };
                Some((*NUMBERS.get(place)?, value))
            }
        }
    }
}

/// The record that begins here, if one does and is whole.
pub fn read(bytes: &[u8]) -> Option<Found<'_>> {
    let (header, rest) = bytes.split_first_chunk::<HEADER_BYTES>()?;
    let [magic, sequence, count] = *header.as_chunks().0 else { return None };
    if magic == old::MAGIC {
        let (head, params) = old::read(bytes)?;
        return Some(Found { sequence: None, bytes: old::BYTES, values: Values::Old(head, params) });
    }
    let count = u32::from_le_bytes(count) as usize;
    if magic != MAGIC || count > VALUES_MAX {
        return None;
    }
    let (values, check) = rest.split_at_checked(8 * count)?;
    let body = bytes.get(..HEADER_BYTES + values.len())?;
    let whole = check.first_chunk() == Some(&CRC.checksum(body).to_le_bytes());
    let values = Values::Named(values.as_chunks().0);
    whole.then_some(Found { sequence: Some(u32::from_le_bytes(sequence)), bytes: slot_bytes(count), values })
}

/// Where the last thing in the sector ends: all behind it is blank.
pub fn end(sector: &[u8]) -> usize {
    let used = sector.chunks_exact(GRID).rposition(|chunk| {
        let (words, _) = chunk.as_chunks::<4>();
        words.iter().any(|word| *word != [BLANK; 4])
    });
    used.map_or(0, |place| (place + 1) * GRID)
}
