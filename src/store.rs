//! Parameters in flash: records, in two sectors that take turns.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 3 | magic "FTPR" |
//! | 4 to 7 | sequence number: one more than the record before; wraps |
//! | 8 to 11 | n, how many values follow |
//! | 12 to 12 + 8 n | n times the number of a value's name, and the value, 32 bits each |
//! | then 4 | CRC-32 (ISO-HDLC) of all before |
//!
//! All little-endian; FF up to the next multiple of 16. The number of a name is its CRC-32, so a firmware with other
//! values takes those that it knows. Behind the parameters come the taxels' gains, two in a value, under the numbers
//! from [`gains_number`] on; they are left out where all are 1.
//!
//! [`Journal`] has the order of writing and erasing: the sector that holds the newest whole record is never erased. So
//! a loss of power leaves the old record or the new one. A record that was cut short fails the CRC: the one before it
//! counts, and [`Loaded::sound`] is false.

mod journal;

pub use journal::{Flash, Journal, Loaded, SaveError, Sector};

use crate::config::ConfigError;
use crate::contact::FitLevel;
use crate::params::{ParamError, Params};
use crate::pressure::Gains;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

/// The largest ID of a device on the bus.
pub const ID_MAX: u8 = 252;
/// The bus speeds that the clocks allow, by the protocol's code (APB1 runs at 42 MHz: 4 and 4.5 Mbaud are 4 % off).
pub const BAUD_RATES: [u32; 6] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000];

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Record of the values that outlive a reset.
///
/// ```
/// use fingertip::shipped::Record;
/// use fingertip::store::{Flash, Journal, Sector};
///
/// /// Two sectors in memory.
/// struct Sectors([[u8; 1024]; 2]);
///
/// impl Flash for Sectors {
///     type Error = ();
///     fn bytes(&self, sector: Sector) -> &[u8] {
///         &self.0[sector as usize]
///     }
///     fn program(&mut self, sector: Sector, offset: usize, word: u32) -> Result<(), ()> {
///         self.0[sector as usize][offset..offset + 4].copy_from_slice(&word.to_le_bytes());
///         Ok(())
///     }
///     fn erase(&mut self, sector: Sector) -> Result<(), ()> {
///         self.0[sector as usize].fill(0xff);
///         Ok(())
///     }
/// }
///
/// let mut flash = Sectors([[0xff; 1024]; 2]);
/// let record = Record { id: 7, ..Record::DEFAULT };
/// Journal::new(&flash).save(&mut flash, &record, || ()).unwrap();
/// assert_eq!(Journal::new(&flash).load(&flash, |_| ()).record, record);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record<const ROWS: usize, const COLUMNS: usize> {
    /// Address on the bus, 0 to 252.
    pub id: u8,
    /// Bus speed by the protocol's code: [`BAUD_RATES`].
    pub baud_code: u8,
    /// Pause before a reply, in units of 2 us.
    pub return_delay_2us: u8,
    /// Largest amount of work per frame for the contact.
    pub fit_level: FitLevel,
    /// The parameters.
    pub params: Params,
    /// The taxels' gains.
    pub gains: Gains<ROWS, COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// Default values: ID 1, 1 Mbaud, 500 us.
    pub const DEFAULT: Self = Self {
        id: 1,
        baud_code: 3,
        return_delay_2us: 250,
        fit_level: FitLevel::OneRow,
        params: Params::DEFAULT,
        gains: Gains::ONE,
    };
}

impl<const ROWS: usize, const COLUMNS: usize> Default for Record<ROWS, COLUMNS> {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Number of values before the parameters.
const HEAD_COUNT: usize = 4;
/// Number of values of this firmware without the gains.
const COUNT: usize = HEAD_COUNT + Params::COUNT;

/// Name, least and largest value of the values before the parameters. The names are stored, so they must not change.
const HEAD: [(&str, i32, i32); HEAD_COUNT] = [
    ("id", 0, ID_MAX as i32),
    ("baud_code", 0, BAUD_RATES.len() as i32 - 1),
    ("return_delay_2us", 0, 254),
    ("fit_level", 0, FitLevel::AllRows as i32),
];

/// Returns the number under which a value is stored: the CRC-32 (ISO-HDLC) of its name.
pub const fn number(name: &str) -> u32 {
    CRC.checksum(name.as_bytes())
}

/// The numbers of this firmware's values, in order.
static NUMBERS: [u32; COUNT] = numbers();

const fn numbers() -> [u32; COUNT] {
    let mut numbers = [0; COUNT];
    let mut place = 0;
    while place < COUNT {
        let name = if place < HEAD_COUNT { HEAD[place].0 } else { Params::RANGES[place - HEAD_COUNT].0 };
        numbers[place] = number(name);
        let mut other = 0;
        while other < place {
            assert!(numbers[other] != numbers[place], "two names have the same number: rename one");
            other += 1;
        }
        place += 1;
    }
    numbers
}

/// Returns the number under which an array's first two gains are stored; the next two are stored under the next
/// number. Arrays of other shapes have other numbers.
pub const fn gains_number(rows: usize, columns: usize) -> u32 {
    let shape =
        [b'0' + rows as u8 / 10, b'0' + rows as u8 % 10, b'x', b'0' + columns as u8 / 10, b'0' + columns as u8 % 10];
    let mut digest = CRC.digest();
    digest.update(b"gains_");
    digest.update(&shape);
    digest.finalize()
}

/// Returns true if no other value is stored under the numbers of an array's gains.
const fn gains_stand_apart(rows: usize, columns: usize) -> bool {
    let numbers = numbers();
    let mut place = 0;
    while place < COUNT {
        if (numbers[place].wrapping_sub(gains_number(rows, columns)) as usize) < rows * columns {
            return false;
        }
        place += 1;
    }
    true
}

/// Returns name, least and largest value of the value in a place.
fn range(place: usize) -> (&'static str, i32, i32) {
    let param = || Params::RANGES.get(place - HEAD_COUNT).map(|&(name, _, min, max)| (name, min, max));
    HEAD.get(place).copied().or_else(param).unwrap_or_default()
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// The values in order, without the gains.
    fn values(&self) -> [i32; COUNT] {
        let head = [self.id, self.baud_code, self.return_delay_2us, self.fit_level as u8];
        let mut values = [0; COUNT];
        let all = head.into_iter().map(i32::from).chain(self.params.to_array());
        for (place, value) in values.iter_mut().zip(all) {
            *place = value;
        }
        values
    }

    /// The inverse, for values in their ranges; gains of 1.
    fn from_values(values: &[i32; COUNT]) -> Self {
        let [id, baud_code, return_delay_2us, fit_level, rest @ ..] = values;
        let [id, baud_code, return_delay_2us, fit_level] =
            [id, baud_code, return_delay_2us, fit_level].map(|value| *value as u8);
        Self {
            id,
            baud_code,
            return_delay_2us,
            fit_level: FitLevel::from_number(fit_level),
            params: Params::from_array(rest),
            gains: Gains::ONE,
        }
    }
}

/// Remark about the stored values at a start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Remark {
    /// No whole record in a flash that is not blank: the defaults are used. Counts as a fault.
    NoneWhole,
    /// Bytes after the newest whole record are damaged, most likely cut short: the values before them are used. It is
    /// a fault.
    Torn,
    /// A value is out of its range: its default is used. It is a fault.
    Refused(ParamError),
    /// Another firmware had a value whose name this one does not know.
    Unknown {
        /// The number of its name.
        number: u32,
        /// The value.
        value: i32,
    },
    /// The record has no such value: its default is used.
    New(&'static str),
}

/// Returns the values that this firmware knows, and true if all of those were accepted.
///
/// Gains are accepted all or not at all.
#[inline(never)]
fn take<const ROWS: usize, const COLUMNS: usize>(
    found: &Found<'_>,
    mut tell: impl FnMut(Remark),
) -> (Record<ROWS, COLUMNS>, bool) {
    let mut values = Record::<ROWS, COLUMNS>::DEFAULT.values();
    let mut missing = [true; COUNT];
    let mut sound = true;
    let (mut gains, mut words, mut taken) = (Gains::ONE, 0, 0);
    let first = const { gains_number(ROWS, COLUMNS) };
    for (number, value) in found.values() {
        let word = number.wrapping_sub(first) as usize;
        if word < Gains::<ROWS, COLUMNS>::WORDS {
            words += 1;
            taken += usize::from(gains.set_word(word, value.cast_unsigned()));
            continue;
        }
        let places = values.iter_mut().zip(&mut missing).zip(&NUMBERS).enumerate();
        let Some((place, ((slot, missing), _))) = places.into_iter().find(|(_, (_, own))| **own == number) else {
            tell(Remark::Unknown { number, value });
            continue;
        };
        *missing = false;
        let (name, min, max) = range(place);
        if (min..=max).contains(&value) {
            *slot = value;
        } else {
            sound = false;
            tell(Remark::Refused(ParamError { name, value, min, max }));
        }
    }
    for (place, _) in missing.iter().enumerate().filter(|(_, missing)| **missing) {
        tell(Remark::New(range(place).0));
    }
    let mut record = Record::from_values(&values);
    if taken == Gains::<ROWS, COLUMNS>::WORDS {
        record.gains = gains;
    } else if words > 0 {
        sound = false;
        let [min, max] = [Gains::<ROWS, COLUMNS>::MIN, Gains::<ROWS, COLUMNS>::MAX].map(i32::from);
        tell(Remark::Refused(ParamError { name: "gains", value: taken as i32, min, max }));
    }
    (record, sound)
}

/// Calls `make` with the parameters. Parameters that contradict each other are set back to their defaults, and `tell`
/// is called with the reason.
///
/// Returns none if `make` fails even with the defaults.
pub fn settle<T>(
    params: &mut Params,
    mut make: impl FnMut(&Params) -> Result<T, ConfigError>,
    mut tell: impl FnMut(ConfigError),
) -> Option<T> {
    // Each round but the last sets back at least one.
    for _ in 0..=Params::COUNT {
        match make(params) {
            Ok(made) => return Some(made),
            Err(error) => {
                tell(error);
                give_up(params, error);
            }
        }
    }
    None
}

/// Resets the parameters that the error names to their defaults, or all parameters if that changes nothing.
#[inline(never)]
fn give_up(params: &mut Params, error: ConfigError) {
    let names = error.parameters();
    let mut values = params.to_array();
    let mut changed = false;
    for (value, (name, default, ..)) in values.iter_mut().zip(&Params::RANGES) {
        if names.contains(name) {
            changed |= *value != *default;
            *value = *default;
        }
    }
    *params = if changed { Params::from_array(&values) } else { Params::DEFAULT };
}

const MAGIC: [u8; 4] = *b"FTPR";
const HEADER_BYTES: usize = 12;
/// Largest number of values that any firmware writes.
const VALUES_MAX: usize = 512;
/// Value of a byte of flash after an erase.
const BLANK: u8 = 0xFF;
/// Distance of the places where a record may begin, bytes.
const GRID: usize = 16;

/// Distance from a record of this firmware whose gains are all 1 to the next one, bytes.
pub const SLOT_BYTES: usize = slot_bytes(COUNT);

/// Distance from a record with `count` values to the next one, bytes.
const fn slot_bytes(count: usize) -> usize {
    (HEADER_BYTES + 8 * count + 4).next_multiple_of(GRID)
}

impl<const ROWS: usize, const COLUMNS: usize> Record<ROWS, COLUMNS> {
    /// Distance from the longest record of this array to the next one, bytes.
    pub const SLOT_MAX: usize = {
        assert!(gains_stand_apart(ROWS, COLUMNS), "the gains' numbers are those of other values: rename one");
        slot_bytes(COUNT + Gains::<ROWS, COLUMNS>::WORDS)
    };

    fn stored_gains(&self) -> usize {
        if self.gains == Gains::ONE { 0 } else { Gains::<ROWS, COLUMNS>::WORDS }
    }

    /// Distance from this record to the next one, bytes.
    pub fn slot_bytes(&self) -> usize {
        slot_bytes(COUNT + self.stored_gains())
    }
}

/// Returns the words of a record as written to flash, up to where the next one may begin.
pub fn words<const ROWS: usize, const COLUMNS: usize>(
    record: &Record<ROWS, COLUMNS>,
    sequence: u32,
) -> impl Iterator<Item = u32> {
    let (gains, length) = (record.stored_gains(), record.slot_bytes() / 4);
    let (count, values) = (COUNT + gains, record.values());
    let first = const { gains_number(ROWS, COLUMNS) };
    let word = move |place: usize| match place {
        0 => u32::from_le_bytes(MAGIC),
        1 => sequence,
        2 => count as u32,
        _ => {
            let (entry, is_value) = ((place - 3) / 2, place.is_multiple_of(2));
            let gains = entry.wrapping_sub(COUNT);
            match (NUMBERS.get(entry), values.get(entry)) {
                (Some(_), Some(value)) if is_value => value.cast_unsigned(),
                (Some(number), _) => *number,
                _ if is_value => record.gains.word(gains),
                _ => first.wrapping_add(gains as u32),
            }
        }
    };
    let body = 3 + 2 * count;
    let mut digest = CRC.digest();
    (0..body).for_each(|place| digest.update(&word(place).to_le_bytes()));
    let check = digest.finalize();
    (0..length).map(move |place| match place {
        _ if place < body => word(place),
        _ if place == body => check,
        _ => u32::from_le_bytes([BLANK; 4]),
    })
}

/// A whole record in flash.
#[derive(Clone, Copy)]
struct Found<'a> {
    /// Number of the record: each is one more than the one before.
    pub sequence: u32,
    /// Distance from its start to where the next may begin, bytes.
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

/// Returns the record that begins here, if there is one and it is whole.
fn read_record(bytes: &[u8]) -> Option<Found<'_>> {
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
