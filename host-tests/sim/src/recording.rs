//! Recordings: MCAP files that Foxglove and PlotJuggler open without a plugin, and that replay to the bit.
//!
//! | topic | schema | when | what |
//! | --- | --- | --- | --- |
//! | `/finger0/scalars` | `fingertip.Scalars` | each `every`-th step | sensed and true values, each a number of its own, the unit in its name |
//! | `/finger0/frame` | `fingertip.Frame` | 100 times a second | the frame's codes, `[slot][column]` |
//! | `/finger0/image` | `foxglove.RawImage` | 100 times a second | the same as a grey picture |
//! | `/finger0/core` | `fingertip.Core` | each step | all that the core was given, byte for byte, and a digest of all that it answered |
//!
//! The scene's text is attached, the controllers' parameters are metadata: a replay needs no other file. A recording of
//! the emulated board holds what is seen of it from outside, a step each millisecond: it cannot be replayed, and says
//! so.

mod replay;
mod write;

pub use replay::{Difference, Replay, replay};
pub use write::Recorder;

use crate::run::RunError;
use crate::watch::Controller;
use fingertip::params::Params;
use mcap::MAGIC;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use twox_hash::xxhash3_128::Hasher;

/// The metadata record that holds the scene and the controllers.
const SETUP: &str = "fingertip.setup";
/// The metadata record that closes a whole recording.
const END: &str = "fingertip.end";

/// Its entry that says whether a replay is possible.
const WHOLE: &str = "whole";

/// Entries of what closes it: digests of the record that holds the controllers, and of the scene's text.
const OF_SETUP: &str = "setup";
const OF_SCENE: &str = "scene";

fn topic(finger: usize, what: &str) -> String {
    format!("/finger{finger}/{what}")
}

/// A controller as JSON: its parameters by name, its calibration by taxel.
fn controller_json(controller: &Controller) -> Value {
    let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
    let params: Map<String, Value> = names.zip(controller.params.to_array().map(Value::from)).collect();
    json!({ "params": params, "calibration": controller.calibration })
}

/// The inverse; none where something is missing or of another kind.
fn controller_of(value: &Value) -> Option<Controller> {
    let mut values = [0; Params::COUNT];
    for ((name, ..), place) in Params::RANGES.iter().zip(&mut values) {
        *place = value["params"][name].as_i64()?.try_into().ok()?;
    }
    let calibration = serde_json::from_value(value["calibration"].clone()).ok()?;
    Some(Controller { params: Params::from_array(&values), calibration })
}

/// A topic's last part, its schema's name, and the schema.
pub fn schemas() -> [(&'static str, &'static str, String); 4] {
    let [frame, image] = [
        include_str!("../../../tool/src/messages/frame.json"),
        include_str!("../../../tool/src/messages/raw_image.json"),
    ];
    [
        ("scalars", "fingertip.Scalars", scalars().to_string()),
        ("frame", "fingertip.Frame", frame.into()),
        ("image", "foxglove.RawImage", image.into()),
        ("core", "fingertip.Core", core().to_string()),
    ]
}

/// The scalars: names in the order in which they are written, with what they are.
pub const SCALARS: [(&str, &str); 20] = [
    ("time_s", "Virtual time from the scene's start"),
    ("goal_n", "The force asked for"),
    ("sensed_force_n", "Normal force as the controller senses it"),
    ("true_force_n", "Normal force between tip and object"),
    ("indentation_mm", "Indentation of the tip"),
    ("travel_mm", "Way of the tip from its start"),
    ("speed_mm_per_s", "Speed of the tip"),
    ("duty_percent", "Share of the supply at the motor; positive presses"),
    ("current_a", "Winding current"),
    ("supply_v", "Supply at the bridge"),
    ("winding_c", "Temperature of the winding"),
    ("centre_x_mm", "Sensed centre of the contact along the columns"),
    ("centre_y_mm", "Sensed centre of the contact along the rows"),
    ("confidence_percent", "Confidence that the contact is a tip on a plane"),
    ("mode", "Mode, by its number on the bus"),
    ("fault", "Fault, by its number on the bus; 0 is none"),
    ("limits", "Limits, a bit each as on the bus"),
    ("tangential_n", "Tangential force on the object, upwards"),
    ("slip_mm", "Way that the contact has slipped"),
    ("object_height_mm", "Height of the object"),
];

fn scalars() -> Value {
    let properties: serde_json::Map<_, _> = SCALARS
        .iter()
        .map(|(name, about)| ((*name).to_owned(), json!({ "type": "number", "description": about })))
        .collect();
    json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties })
}

fn core() -> Value {
    let record = "Frame, sense and command in the layout of images::record::Record, base64";
    let digest = "CRC-64/XZ of the duty and of every field of the status, hexadecimal";
    json!({
        "title": "fingertip.Core",
        "type": "object",
        "properties": {
            "record": { "type": "string", "contentEncoding": "base64", "description": record },
            "duty": { "type": "integer", "description": "The duty that the core answered, Q15" },
            "digest": { "type": "string", "description": digest },
        },
    })
}

// Whether a recording is as it was written: every byte of the file stands under a checksum, and all are looked at.
//
// MCAP has one over all in front of the record `DataEnd` and one over the summary behind it, footer included. What
// these do not cover (the checksums themselves, both ends' magic, the head of `DataEnd`) can only be one thing.

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
