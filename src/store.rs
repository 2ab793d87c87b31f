//! Parameters in flash: a record, and a sector to which records are appended.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 3 | magic "FTIP" |
//! | 4 to 7 | fingerprint of the layout: CRC-32 of the names of all that follows, in order |
//! | 8, 9, 10, 11 | ID, baud code, return delay, effort |
//! | 12 to 12 + 4 n | parameters in the order of [`Params`], 32 bits each |
//! | then 4 | CRC-32 (ISO-HDLC) of all before |
//!
//! All little-endian; FF up to the next multiple of 16. The newest record is the last that is not blank. A write cut
//! short fails the CRC: it is reported, not skipped, because the values that the user saved are not the ones before it.
//! A firmware with other parameters, or the same in another order, refuses the record: no value is taken for another's.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::contact::Effort;
use crate::params::{ParamError, Params};

/// The largest ID of a device on the bus.
pub const ID_MAX: u8 = 252;
/// The bus speeds that the clocks allow, by the protocol's code (APB1 runs at 42 MHz: 4 and 4.5 Mbaud are 4 % off).
pub const BAUD_RATES: [u32; 6] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000];

const MAGIC: [u8; 4] = *b"FTIP";
const HEADER_BYTES: usize = 12;
const CRC_PLACE: usize = HEADER_BYTES + 4 * Params::COUNT;
/// The names of what stands before the parameters.
const HEAD: &[u8] = b"id\nbaud_code\nreturn_delay_2us\neffort\n";
const LAYOUT: [u8; 4] = fingerprint().to_le_bytes();
/// What flash reads after an erase.
const BLANK: u8 = 0xFF;
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

const fn fingerprint() -> u32 {
    let mut digest = CRC.digest();
    digest.update(HEAD);
    let mut place = 0;
    while place < Params::COUNT {
        digest.update(Params::RANGES[place].0.as_bytes());
        digest.update(b"\n");
        place += 1;
    }
    digest.finalize()
}

/// From record to record in the sector.
pub const SLOT_BYTES: usize = (CRC_PLACE + 4).next_multiple_of(16);

/// What outlives a reset.
///
/// ```
/// use fingertip::store::{Record, encode, latest, next_offset};
///
/// let mut sector = [0xff_u8; 1024]; // erased
/// let record = Record { id: 7, ..Record::DEFAULT };
/// let place = next_offset(&sector).expect("room");
/// let bytes = encode(&record);
/// sector[place..place + bytes.len()].copy_from_slice(&bytes);
/// assert_eq!(latest(&sector), Ok(Some(record)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Address on the bus, 0 to 252.
    pub id: u8,
    /// Bus speed by the protocol's code: [`BAUD_RATES`].
    pub baud_code: u8,
    /// Pause before a reply, in units of 2 us.
    pub return_delay_2us: u8,
    /// How much work the loop may put into a contact.
    pub effort: Effort,
    /// The parameters.
    pub params: Params,
}

impl Record {
    /// What a blank flash stands for: ID 1, 1 Mbaud, 500 us.
    pub const DEFAULT: Self =
        Self { id: 1, baud_code: 3, return_delay_2us: 250, effort: Effort::OneRow, params: Params::DEFAULT };
}

impl Default for Record {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Why the newest record was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoreError {
    /// Where in the sector it begins.
    pub offset: usize,
    /// What is wrong with it.
    pub damage: Damage,
}

/// What is wrong with a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// It is no whole record of this layout: the write was cut short, the flash lost bits, or another firmware wrote
    /// it.
    Unreadable,
    /// The ID, the baud code, the return delay or the effort is out of its range.
    Head,
    /// A parameter is out of its range.
    Param(ParamError),
}

/// A record as it is written to flash.
pub fn encode(record: &Record) -> [u8; SLOT_BYTES] {
    let mut slot = [BLANK; SLOT_BYTES];
    let head = [record.id, record.baud_code, record.return_delay_2us, record.effort as u8];
    let bytes = (MAGIC.into_iter())
        .chain(LAYOUT)
        .chain(head)
        .chain(record.params.to_array().into_iter().flat_map(i32::to_le_bytes));
    for (place, byte) in slot.iter_mut().zip(bytes) {
        *place = byte;
    }
    if let Some((body, rest)) = slot.split_at_mut_checked(CRC_PLACE) {
        for (place, byte) in rest.iter_mut().zip(CRC.checksum(body).to_le_bytes()) {
            *place = byte;
        }
    }
    slot
}

/// The newest record of a sector, or none where it is blank.
///
/// # Errors
/// The newest record is damaged. [`newest_whole`] has the one before it.
pub fn latest(sector: &[u8]) -> Result<Option<Record>, StoreError> {
    let Some((place, slot)) = used(sector).next() else { return Ok(None) };
    decode(slot).map(Some).map_err(|damage| StoreError { offset: place * SLOT_BYTES, damage })
}

/// The newest record that is whole, skipping damaged ones.
///
/// Good for the ID and the bus speed, so that the fault can be read.
pub fn newest_whole(sector: &[u8]) -> Option<Record> {
    used(sector).find_map(|(_, slot)| decode(slot).ok())
}

/// Where the next record goes; none where the sector is full and must be erased first.
pub fn next_offset(sector: &[u8]) -> Option<usize> {
    let next = used(sector).next().map_or(0, |(place, _)| (place + 1) * SLOT_BYTES);
    (next + SLOT_BYTES <= sector.len()).then_some(next)
}

/// The slots from the newest record back to the oldest, with their places.
fn used(sector: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    sector.chunks_exact(SLOT_BYTES).enumerate().rev().skip_while(|(_, slot)| is_blank(slot))
}

/// Word by word: a blank sector has 32,768 of them.
fn is_blank(slot: &[u8]) -> bool {
    let (words, rest) = slot.as_chunks::<4>();
    words.iter().all(|word| *word == [BLANK; 4]) && rest.iter().all(|byte| *byte == BLANK)
}

fn decode(slot: &[u8]) -> Result<Record, Damage> {
    let (body, tail) = slot.split_at_checked(CRC_PLACE).ok_or(Damage::Unreadable)?;
    let (magic, rest) = body.split_first_chunk::<4>().ok_or(Damage::Unreadable)?;
    let (layout, rest) = rest.split_first_chunk::<4>().ok_or(Damage::Unreadable)?;
    let (head, rest) = rest.split_first_chunk::<4>().ok_or(Damage::Unreadable)?;
    if *magic != MAGIC || *layout != LAYOUT {
        return Err(Damage::Unreadable);
    }
    if tail.first_chunk() != Some(&CRC.checksum(body).to_le_bytes()) {
        return Err(Damage::Unreadable);
    }
    let [id, baud_code, return_delay_2us, effort] = *head;
    if id > ID_MAX
        || usize::from(baud_code) >= BAUD_RATES.len()
        || return_delay_2us == u8::MAX
        || effort > Effort::AllRows as u8
    {
        return Err(Damage::Head);
    }
    let mut values = [0; Params::COUNT];
    for (value, bytes) in values.iter_mut().zip(rest.as_chunks::<4>().0) {
        *value = i32::from_le_bytes(*bytes);
    }
    let params = Params::from_array(&values);
    params.check().map_err(Damage::Param)?;
    Ok(Record { id, baud_code, return_delay_2us, effort: Effort::from_number(effort), params })
}
