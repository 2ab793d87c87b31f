//! The CRC-16 of DYNAMIXEL Protocol 2.0: polynomial 8005h, start 0, most significant bit first, nothing inverted.

use crc::{CRC_16_UMTS, Crc, Table};

static TABLE: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_16_UMTS);

/// The checksum of no bytes.
pub const START: u16 = 0;

/// Continues a checksum over more bytes: `update(update(START, a), b)` is the checksum of `a` followed by `b`.
pub fn update(crc: u16, bytes: &[u8]) -> u16 {
    let mut digest = TABLE.digest_with_initial(crc);
    digest.update(bytes);
    digest.finalize()
}
