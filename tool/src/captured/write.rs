//! A capture's file, written.

use super::{ABOUT, ATTACHED, About, ENDED, through_the_core};
use crate::messages::{Topic, topic};
use crate::state::{Stamp, State};
use fingertip::capture::Head;
use fingertip::params::Params;
use fingertip::pipeline::Status;
use fingertip::shipped::{CLOCKS, COLUMNS, ROWS, SLOTS, TAXELS};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use replay::Taken;
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::io::{Seek, Write};

/// Frames from one message of scalars to the next, and from one of codes to the next.
const SCALARS_EVERY: u32 = 5;
const CODES_EVERY: u32 = 50;
/// As a scene's recording has it: that includes the same file.
const FRAME_SCHEMA: [&str; 2] = ["fingertip.Frame", include_str!("../messages/frame.json")];

type Captured<'a> = (&'a Taken<ROWS, COLUMNS>, &'a Status);

/// Writes a capture with what is known of it.
///
/// # Errors
/// It is no capture of this version, or it cannot be written.
pub fn write(to: impl Write + Seek, bytes: &[u8], about: &About) -> Result<(), String> {
    let mut shown = Vec::new();
    let replayed =
        through_the_core(bytes, |taken, status| shown.push((*taken, *status))).map_err(|why| why.to_string())?;
    let options = WriteOptions::new().profile("").library(concat!("fingertip/", env!("CARGO_PKG_VERSION")));
    let out = options.create(to).map_err(|why| in_words(&why))?;
    put(out, bytes, about, &replayed.head, &shown).map_err(|why| in_words(&why))
}

/// The system's reason where it has one: a full disk is told as such.
fn in_words(why: &McapError) -> String {
    if let McapError::Io(why) = why { why.to_string() } else { why.to_string() }
}

fn put(
    mut out: Writer<impl Write + Seek>,
    bytes: &[u8],
    about: &About,
    head: &Head<ROWS, COLUMNS>,
    shown: &[(Taken<ROWS, COLUMNS>, Status)],
) -> mcap::McapResult<()> {
    let ended_ns = about.get(ENDED).and_then(|ended| ended.parse().ok()).unwrap_or(0_u64);
    let attached = Attachment {
        log_time: ended_ns,
        create_time: ended_ns,
        name: ATTACHED.into(),
        media_type: "application/octet-stream".into(),
        data: Cow::Borrowed(bytes),
    };
    out.attach(&attached)?;
    let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
    let params: Map<String, Value> = names.zip(head.params.to_array().map(Value::from)).collect();
    let gains: Vec<u16> = (0..TAXELS).map(|place| head.gains.get(place)).collect();
    let more = [
        ("params", Value::Object(params).to_string()),
        ("gains_q14", json!(gains).to_string()),
        ("codes_per_kpa_milli", head.params.codes_per_kpa_milli.to_string()),
        ("frame_ns", head.frame_ns.to_string()),
        ("core_hz", CLOCKS.core_hz.to_string()),
        ("frames", head.frames.to_string()),
    ];
    let metadata = more.into_iter().map(|(name, value)| (name.to_owned(), value));
    let metadata = about.clone().into_iter().chain(metadata).collect();
    out.write_metadata(&Metadata { name: ABOUT.into(), metadata })?;
    let id = about.get("id").and_then(|id| id.parse().ok()).unwrap_or(1);
    let scalars = out.add_schema(Topic::Scalars.schema_name(), "jsonschema", &Topic::Scalars.schema())?;
    let scalars = out.add_channel(scalars, &Topic::Scalars.name(id), "json", about)?;
    let codes = out.add_schema(FRAME_SCHEMA[0], "jsonschema", FRAME_SCHEMA[1].as_bytes())?;
    let codes = out.add_channel(codes, &topic(id, "frame"), "json", about)?;
    let sequence = |shown: Option<&(Taken<ROWS, COLUMNS>, Status)>| shown.map_or(0, |(taken, _)| taken.frame.sequence);
    let (first, frame_ns) = (sequence(shown.first()), u64::from(head.frame_ns));
    let since_ns = |sequence: u32| u64::from(sequence.wrapping_sub(first)) * frame_ns;
    let begun_ns = ended_ns.saturating_sub(since_ns(sequence(shown.last())));
    for (frame, captured) in (0..).zip(shown) {
        let since_ns = since_ns(captured.0.frame.sequence);
        let log_time = begun_ns + since_ns;
        let mut message = |channel_id, message: &[u8]| {
            let header = MessageHeader { channel_id, sequence: frame, log_time, publish_time: log_time };
            out.write_to_known_channel(&header, message)
        };
        if frame % SCALARS_EVERY == 0 {
            let state = state((&captured.0, &captured.1), head.frame_ns);
            let stamp = Stamp { time_s: since_ns as f64 * 1e-9, read_ns: log_time, frame_ns: log_time };
            message(scalars, &Topic::Scalars.message(&stamp, &state))?;
        }
        if frame % CODES_EVERY == 0 {
            message(codes, codes_of(&captured.0).to_string().as_bytes())?;
        }
    }
    out.finish().map(drop)
}

fn state((taken, status): Captured<'_>, frame_ns: u32) -> State {
    let thousandths = |value: f64| (value * 1e3).round() as i64;
    let contact = &status.contact;
    State {
        frame: status.sequence.into(),
        goal_mn: thousandths(taken.command.goal.0.to_num()),
        force_mn: thousandths(contact.force.0.to_num()),
        indentation_um: thousandths(contact.indentation.0.to_num()),
        centre_x_um: thousandths(contact.centre_x.0.to_num()),
        centre_y_um: thousandths(contact.centre_y.0.to_num()),
        travel_um: thousandths(status.travel.0.to_num()),
        speed_um_per_s: thousandths(status.speed.0.to_num()),
        duty_permille: (f64::from(status.duty.0) * 1e3 / f64::from(fingertip::units::Duty::FULL)).round() as i64,
        mode: status.mode as i64,
        fault: status.fault.map_or(0, |fault| fault as i64),
        limits: status.limits.0.into(),
        confidence: contact.confidence.into(),
        period_ns: frame_ns.into(),
        ..State::default()
    }
}

fn codes_of(taken: &Taken<ROWS, COLUMNS>) -> Value {
    let codes: Vec<Vec<u16>> =
        (0..SLOTS).map(|slot| (0..COLUMNS).map(|column| taken.frame.code(slot, column)).collect()).collect();
    json!({ "sequence": taken.frame.sequence, "codes": codes })
}
