//! A capture's file, read: whole as it was written, or refused.

use super::{ABOUT, ATTACHED, About};
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::fs;
use std::path::Path;

/// What a file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// The capture, as the board kept it.
    pub bytes: Vec<u8>,
    /// What is known of it.
    pub about: About,
}

/// Reads a file; every byte of it is under a check sum, and all are looked at.
///
/// # Errors
/// It cannot be read, is damaged or cut off, or holds no capture.
pub fn open(path: &Path) -> Result<Kept, String> {
    of_bytes(&fs::read(path).map_err(|why| format!("cannot be read: {why}"))?)
}

/// The same of a file's bytes.
///
/// # Errors
/// They are damaged or cut off, or hold no capture.
pub fn of_bytes(mut rest: &[u8]) -> Result<Kept, String> {
    if !rest.starts_with(mcap::MAGIC) {
        return Err("this is no MCAP file: it does not begin as one".into());
    }
    if !rest.ends_with(mcap::MAGIC) {
        return Err("the file was cut off: it does not end as an MCAP file does".into());
    }
    let damaged = |why: &dyn std::fmt::Display| format!("the file is damaged: {why}");
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_check_finishes_after_end_magic(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(rest.len());
    let mut reader = LinearReader::new_with_options(options);
    let (mut bytes, mut about, mut ends) = (None, None, Vec::new());
    while let Some(event) = reader.next_event() {
        match event.map_err(|why| damaged(&why))? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (now, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode } => {
                match mcap::parse_record(opcode, data).map_err(|why| damaged(&why))? {
                    Record::Attachment { header, data, .. } if header.name == ATTACHED => {
                        bytes = Some(data.into_owned())
                    }
                    Record::Metadata(metadata) if metadata.name == ABOUT => about = Some(metadata.metadata),
                    Record::DataEnd(end) => ends.push(end.data_section_crc),
                    Record::Footer(footer) => ends.push(footer.summary_crc),
                    Record::Unknown { opcode, .. } => return Err(damaged(&format_args!("a record of kind {opcode}"))),
                    _ => {}
                }
            }
        }
    }
    match ends[..] {
        [data, summary] if data != 0 && summary != 0 => {}
        [_, _] => {
            return Err(
                "the file has no check sums: another program wrote it anew. Take the one that it was made from".into(),
            );
        }
        _ => return Err(damaged(&"it has no end of its messages, or no footer")),
    }
    let (Some(bytes), Some(about)) = (bytes, about) else {
        return Err(
            "the file holds no capture: it is a recording of another kind (a scene's is replayed by its own tests)"
                .into(),
        );
    };
    Ok(Kept { bytes, about })
}
