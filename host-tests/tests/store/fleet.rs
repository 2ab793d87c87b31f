//! What firmware with other parameters left in the flash.

use crate::nor::record;
use fingertip::params::Params;
use fingertip::shipped::Record;
use fingertip::store::number;

/// CRC-32 (ISO-HDLC), bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

fn finish(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.extend(crc32(&bytes).to_le_bytes());
    bytes.resize(bytes.len().next_multiple_of(16), 0xFF);
    bytes
}

/// The names before the parameters, and the parameters' names.
pub fn names() -> Vec<&'static str> {
    let head = ["id", "baud_code", "return_delay_2us", "fit_level"].into_iter();
    head.chain(Params::RANGES.iter().map(|(name, ..)| *name)).collect()
}

/// Names and values of a record, in the order in which they are stored.
pub fn named(record: &Record) -> Vec<(&'static str, i32)> {
    let head = [record.id, record.baud_code, record.return_delay_2us, record.fit_level as u8];
    let values = head.map(i32::from).into_iter().chain(record.params.to_array());
    names().into_iter().zip(values).collect()
}

/// A record as its documentation describes it.
pub fn of_values(values: &[(&str, i32)], sequence: u32) -> Vec<u8> {
    let mut bytes = b"FTPR".to_vec();
    bytes.extend(sequence.to_le_bytes());
    bytes.extend((values.len() as u32).to_le_bytes());
    for (name, value) in values {
        assert_eq!(number(name), crc32(name.as_bytes()));
        bytes.extend(number(name).to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    finish(bytes)
}

/// How another firmware's records differ.
#[derive(Clone, Copy, Debug)]
pub enum Other {
    /// Nothing: they are this one's.
    None,
    /// It has one parameter more.
    More,
    /// It has one fewer.
    Fewer,
    /// One has another name there.
    Renamed,
}

pub const OTHERS: [Other; 4] = [Other::None, Other::More, Other::Fewer, Other::Renamed];

/// The parameter that others lack.
pub const LACKED: &str = "clearance_um";

impl Other {
    /// The bytes of its record with this number, and what of it this firmware has to take.
    pub fn record(self, number: i32, sequence: u32) -> (Vec<u8>, Record) {
        let mut whole = record(number);
        whole.params.clearance_um = 777;
        let mut lacking = whole;
        lacking.params.clearance_um = Params::DEFAULT.clearance_um;
        let mut values = named(&whole);
        let place = values.iter().position(|(name, _)| *name == LACKED).expect("there is such a parameter");
        match self {
            Self::None => (of_values(&values, sequence), whole),
            Self::More => {
                values.insert(place, ("one_more", -5));
                (of_values(&values, sequence), whole)
            }
            Self::Fewer => {
                values.remove(place);
                (of_values(&values, sequence), lacking)
            }
            Self::Renamed => {
                values[place].0 = "another_name";
                (of_values(&values, sequence), lacking)
            }
        }
    }
}
