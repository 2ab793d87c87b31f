//! The records of firmware up to 0.1: no names, but a fingerprint of all names in order.
//!
//! | bytes | content |
//! | --- | --- |
//! | 0 to 3 | magic "FTIP" |
//! | 4 to 7 | CRC-32 of the names of all that follows, each with a newline behind it |
//! | 8, 9, 10, 11 | ID, baud code, return delay, fit level |
//! | 12 to 12 + 4 n | the parameters in order, 32 bits each |
//! | then 4 | CRC-32 (ISO-HDLC) of all before |
//!
//! They can be read as long as these parameters come first, in the same order: see [`LAYOUT`]. What they lack takes
//! its default.

use super::CRC;
use crate::params::Params;

/// Parameters that they have: the first so many.
const COUNT: usize = 30;
pub const MAGIC: [u8; 4] = *b"FTIP";
const HEAD: &[u8] = b"id\nbaud_code\nreturn_delay_2us\neffort\n";
const BODY_BYTES: usize = 12 + 4 * COUNT;
const LAYOUT: [u8; 4] = fingerprint().to_le_bytes();
/// From the record's start to the next one's.
pub const BYTES: usize = (BODY_BYTES + 4).next_multiple_of(16);

const fn fingerprint() -> u32 {
    let mut digest = CRC.digest();
    digest.update(HEAD);
    let mut place = 0;
    while place < COUNT {
        digest.update(Params::RANGES[place].0.as_bytes());
        digest.update(b"\n");
        place += 1;
    }
    digest.finalize()
}

/// The four bytes before the parameters, and the parameters.
pub fn read(bytes: &[u8]) -> Option<(&[u8; 4], &[[u8; 4]])> {
    let (body, check) = bytes.split_at_checked(BODY_BYTES)?;
    let (magic, rest) = body.split_first_chunk()?;
    let (layout, rest) = rest.split_first_chunk()?;
    let (head, params) = rest.split_first_chunk()?;
    let known = *magic == MAGIC && *layout == LAYOUT;
    (known && check.first_chunk() == Some(&CRC.checksum(body).to_le_bytes())).then_some((head, params.as_chunks().0))
}
