//! MCAP files of captures and of scenes, all of whose bytes are checked, and the image that both have.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use mcap::records::{Metadata, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, Summary};
use serde_json::{Value, json};

/// Checks a file: every byte of it is covered by a checksum, or has fixed contents. The error names the part.
pub fn check(mut rest: &[u8]) -> Result<(), String> {
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_record_length_limit(rest.len())
        .with_check_finishes_after_end_magic(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true);
    let mut reader = LinearReader::new_with_options(options);
    let mut lacks_checksum = Vec::new();
    while let Some(event) = reader.next_event() {
        match event.map_err(damage)? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (next, later) = rest.split_at(wanted.min(rest.len()));
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                rest = later;
            }
            LinearReadEvent::Record { opcode: op::DATA_END | op::FOOTER, data } => {
                lacks_checksum.push(data.ends_with(&[0; 4]));
            }
            LinearReadEvent::Record { .. } => {}
        }
    }
    match lacks_checksum[..] {
        [false, false] => Ok(()),
        [_, _] => Err("the recording lacks a checksum: another program rewrote it. Replay the original".into()),
        _ => Err("the recording is damaged: it has no end of its messages, or no footer".into()),
    }
}

fn damage(error: McapError) -> String {
    match error {
        McapError::BadMagic => "this is no MCAP file: it does not begin and end as one".into(),
        McapError::UnexpectedEof => "the recording was cut off: it does not end as an MCAP file does".into(),
        McapError::BadDataCrc { .. } => {
            "the recording is damaged in its messages, its metadata or what is attached: the CRC \
                                         differs. Copy it or record it again"
                .into()
        }
        McapError::BadSummaryCrc { .. } => {
            "the recording is damaged in its summary, behind its messages: the CRC differs".into()
        }
        error => format!("the recording is damaged: {error}"),
    }
}

pub fn summary(bytes: &[u8]) -> Result<Summary, String> {
    Summary::read(bytes).map_err(damage)?.ok_or_else(|| "the file has no summary: the recording was cut off".into())
}

/// Metadata of this name.
pub fn metadata(bytes: &[u8], name: &str) -> Result<Metadata, String> {
    let summary = summary(bytes)?;
    let index = summary.metadata_indexes.iter().find(|index| index.name == name);
    let index = index.ok_or_else(|| format!("no {name} in the file: not a whole recording of this project"))?;
    mcap::read::metadata(bytes, index).map_err(damage)
}

/// Image of the array, by rows of grey levels; the last row is on top.
pub fn image(time_ns: u64, frame_id: &str, rows: &[Vec<u8>]) -> Value {
    let width = rows.first().map_or(0, Vec::len);
    let data: Vec<u8> = rows.iter().rev().flatten().copied().collect();
    json!({
        "timestamp": { "sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000 },
        "frame_id": frame_id, "width": width, "height": rows.len(), "encoding": "mono8", "step": width,
        "data": BASE64_STANDARD.encode(data),
    })
}
