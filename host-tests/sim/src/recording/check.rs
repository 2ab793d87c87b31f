//! Whether a recording is as it was written: every byte of the file stands under a checksum, and all are looked at.
//!
//! MCAP has one over all in front of the record `DataEnd` and one over the summary behind it, footer included. What
//! these do not cover (the checksums themselves, both ends' magic, the head of `DataEnd`) can only be one thing.

use crate::run::RunError;
use mcap::MAGIC;
use std::collections::BTreeMap;
use twox_hash::xxhash3_128::Hasher;

const CRC: crc::Crc<u32, crc::Table<16>> = crc::Crc::<u32, crc::Table<16>>::new(&crc::CRC_32_ISO_HDLC);

/// The records' numbers.
const FOOTER: u8 = 2;
const DATA_END: u8 = 15;
/// A record's number and length.
const HEAD: usize = 9;
/// `DataEnd` and `Footer`, whole.
const DATA_END_BYTES: usize = HEAD + 4;
const FOOTER_BYTES: usize = HEAD + 20;

/// Checks a file.
///
/// # Errors
/// It is cut off or changed; the text says in which part.
pub fn check(bytes: &[u8]) -> Result<(), RunError> {
    if !bytes.starts_with(MAGIC) {
        return Err("this is no MCAP file: it does not begin as one".into());
    }
    let cut = "the recording was cut off: it does not end as an MCAP file does";
    let end = bytes.strip_suffix(MAGIC).and_then(|bytes| bytes.len().checked_sub(FOOTER_BYTES)).ok_or(cut)?;
    let footer = &bytes[end..end + FOOTER_BYTES];
    let start = usize::try_from(number(footer, HEAD)).unwrap_or(usize::MAX);
    let data_end = start.checked_sub(DATA_END_BYTES).filter(|_| start <= end);
    if !is_head(footer, FOOTER, 20) || data_end.is_none() {
        return Err("the recording is damaged in its footer".into());
    }
    let data_end = data_end.unwrap_or(0);
    if word(footer, FOOTER_BYTES - 4) != CRC.checksum(&bytes[start..end + FOOTER_BYTES - 4]) {
        return Err("the recording is damaged in its summary, behind its messages: the CRC is another".into());
    }
    let (data, end) = bytes.split_at(data_end);
    if !is_head(end, DATA_END, 4) {
        return Err("the recording is damaged at the end of its messages".into());
    }
    if word(end, HEAD) == 0 {
        return Err("the recording has no checksum over its data: another program wrote it anew. Replay the one that it was made from".into());
    }
    if word(end, HEAD) != CRC.checksum(data) {
        return Err("the recording is damaged in its messages, its metadata or the attached scene: the CRC is another. Copy it anew, or record the scene again".into());
    }
    Ok(())
}

/// Of a metadata record's entries: says whether they are the ones that were written, also after another program wrote
/// the file anew.
pub fn digest(entries: &BTreeMap<String, String>) -> String {
    texts(entries.iter().flat_map(|(name, value)| [name.as_bytes(), value.as_bytes()]))
}

/// The same of texts.
pub fn texts<'a>(texts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut digest = Hasher::new();
    for text in texts {
        digest.write(&(text.len() as u64).to_le_bytes());
        digest.write(text);
    }
    format!("{:032x}", digest.finish_128())
}

fn is_head(record: &[u8], kind: u8, length: u64) -> bool {
    record[0] == kind && number(record, 1) == length
}

fn number(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(core::array::from_fn(|n| bytes[at + n]))
}

fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(core::array::from_fn(|n| bytes[at + n]))
}
