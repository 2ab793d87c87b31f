//! Recordings and captures as MCAP files, and a state as messages for what shows recordings.
//!
//! A recording has the topics and the names of the scenes', so that what shows those shows it (`tests/finger/recorded.rs`):
//! the numbers are `fingertip.Scalars`, the pressures a grey image. A capture is kept as the board made it:
//!
//! | part | what |
//! | --- | --- |
//! | attachment `capture.bin` | the capture, byte for byte (`fingertip::capture`): all that a replay needs |
//! | metadata `fingertip.capture` | whose it is: board, firmware, image, notes, licence; and for people parameters, gains, frame time |
//! | `/fingerN/scalars`, `/fingerN/frame`, N the ID less one | as in a scene's recording: what the core on this machine makes of the frames |

use crate::commands::params::named;
use crate::state::{Stamp, State};
use crate::{Client, Error};
use fingertip::capture::Head;
use fingertip::pipeline::Status;
use fingertip::shipped::{CLOCKS, COLUMNS, ROWS, SLOTS, TAXELS, address};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use replay::{CapturedFrame, ReplayError, Replayed, file, replay};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Seek, Write};
use std::path::Path;

const ATTACHED: &str = "capture.bin";
const ABOUT: &str = "fingertip.capture";
/// Entry of the metadata: host's time of the last frame, ns since 1970.
pub const ENDED: &str = "ended_unix_ns";

/// Metadata of a capture or of a controller, by name.
pub type About = BTreeMap<String, String>;

type Frame = CapturedFrame<ROWS, COLUMNS>;
type Fed = Result<Replayed<ROWS, COLUMNS>, ReplayError>;

/// Feeds a capture through the core on this machine.
pub fn through_the_core(bytes: &[u8], each: impl FnMut(&Frame, &Status)) -> Fed {
    replay(bytes, &CLOCKS, each)
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    pub bytes: Vec<u8>,
    pub about: About,
}

/// Reads a file; every byte of it is under a check sum, and all are looked at.
pub fn open(path: &Path) -> Result<Kept, String> {
    of_bytes(&fs::read(path).map_err(|why| format!("cannot be read: {why}"))?)
}

pub fn of_bytes(bytes: &[u8]) -> Result<Kept, String> {
    file::check(bytes)?;
    let none = "the file holds no capture: a scene's recording is replayed by the scene's own tests";
    let about = file::metadata(bytes, ABOUT).map_err(|_| none)?.metadata;
    let attached = file::summary(bytes)?.attachment_indexes.into_iter().find(|index| index.name == ATTACHED);
    let attached = mcap::read::attachment(bytes, &attached.ok_or(none)?).map_err(|why| why.to_string())?;
    Ok(Kept { bytes: attached.data.into_owned(), about })
}

/// Frames from one message of scalars to the next, and from one of codes to the next.
const SCALARS_EVERY: u32 = 5;
const CODES_EVERY: u32 = 50;

/// Schema of a frame; recordings of scenes include the same file.
const FRAME_SCHEMA: &str = include_str!("messages/frame.json");

/// Writes a capture with what is known of it.
pub fn write(to: impl Write + Seek, bytes: &[u8], about: &About) -> Result<(), String> {
    let mut shown = Vec::new();
    let replayed =
        through_the_core(bytes, |taken, status| shown.push((*taken, *status))).map_err(|why| why.to_string())?;
    let out = write_options().create(to).and_then(|out| put(out, bytes, about, &replayed.head, &shown));
    out.map_err(|why| in_words(why).to_string())
}

/// The system's reason if there is one, for example a full disk.
pub fn in_words(why: McapError) -> io::Error {
    match why {
        McapError::Io(why) => why,
        other => io::Error::other(other),
    }
}

pub fn write_options() -> WriteOptions {
    WriteOptions::new().profile("").library(concat!("fingertip/", env!("CARGO_PKG_VERSION")))
}

fn put(
    mut out: Writer<impl Write + Seek>,
    bytes: &[u8],
    about: &About,
    head: &Head<ROWS, COLUMNS>,
    shown: &[(Frame, Status)],
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
    let gains: Vec<u16> = (0..TAXELS).map(|place| head.gains.get(place)).collect();
    let more = [
        ("params", Value::Object(named(&head.params)).to_string()),
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
    let scalars = Topic::Scalars.add_to(&mut out, id, about)?;
    let codes = out.add_schema("fingertip.Frame", "jsonschema", FRAME_SCHEMA.as_bytes())?;
    let codes = out.add_channel(codes, &topic(id, "frame"), "json", about)?;
    let first = shown.first().map_or(0, |(taken, _)| taken.frame.sequence);
    let since_ns = |taken: &Frame| u64::from(taken.frame.sequence.wrapping_sub(first)) * u64::from(head.frame_ns);
    let begun_ns = ended_ns.saturating_sub(shown.last().map_or(0, |(taken, _)| since_ns(taken)));
    for (frame, (taken, status)) in (0..).zip(shown) {
        let since_ns = since_ns(taken);
        let log_time = begun_ns + since_ns;
        let mut message = |channel_id, message: &[u8]| {
            let header = MessageHeader { channel_id, sequence: frame, log_time, publish_time: log_time };
            out.write_to_known_channel(&header, message)
        };
        if frame % SCALARS_EVERY == 0 {
            let state = state(taken, status, head.frame_ns);
            let stamp = Stamp { time_s: since_ns as f64 * 1e-9, read_ns: log_time, frame_ns: log_time };
            message(scalars, &Topic::Scalars.message(&stamp, &state))?;
        }
        if frame % CODES_EVERY == 0 {
            let row = |slot| (0..COLUMNS).map(|column| taken.frame.code(slot, column)).collect();
            let rows: Vec<Vec<u16>> = (0..SLOTS).map(row).collect();
            let frame = json!({ "sequence": taken.frame.sequence, "codes": rows });
            message(codes, frame.to_string().as_bytes())?;
        }
    }
    out.finish().map(drop)
}

fn state(taken: &Frame, status: &Status, frame_ns: u32) -> State {
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

/// Schema of <https://docs.foxglove.dev/docs/sdk/schemas/raw-image>; recordings of scenes include the same file.
const IMAGE_SCHEMA: &str = include_str!("messages/raw_image.json");
/// Pa for a grey level: that of the scenes, 8 codes at 24 codes for a kPa.
const PA_PER_GREY: i64 = 333;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    Scalars,
    Image,
}

impl Topic {
    pub fn name(self, id: u8) -> String {
        topic(id, if self == Self::Scalars { "scalars" } else { "image" })
    }

    pub fn schema_name(self) -> &'static str {
        if self == Self::Scalars { "fingertip.Scalars" } else { "foxglove.RawImage" }
    }

    pub fn schema(self) -> Vec<u8> {
        match self {
            Self::Scalars => {
                let number = |about| json!({ "type": "number", "description": about });
                let scalars = scalars(0.0, &State::default());
                let properties = Map::from_iter(scalars.map(|(name, about, _)| (name.to_owned(), number(about))));
                let schema = json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties });
                schema.to_string().into_bytes()
            }
            Self::Image => IMAGE_SCHEMA.into(),
        }
    }

    pub fn add_to(self, out: &mut Writer<impl Write + Seek>, id: u8, device: &About) -> mcap::McapResult<u16> {
        let schema = out.add_schema(self.schema_name(), "jsonschema", &self.schema())?;
        out.add_channel(schema, &self.name(id), "json", device)
    }

    pub fn message(self, stamp: &Stamp, state: &State) -> Vec<u8> {
        let message = match self {
            Self::Scalars => {
                let named = scalars(stamp.time_s, state).map(|(name, _, value)| (name.to_owned(), value));
                Value::Object(Map::from_iter(named))
            }
            Self::Image => {
                let grey = |pa: &i64| (pa / PA_PER_GREY).clamp(0, 255) as u8;
                let rows = state.pressures_pa.chunks(COLUMNS).map(|row| row.iter().map(grey).collect());
                file::image(stamp.frame_ns, "array", &rows.collect::<Vec<_>>())
            }
        };
        message.to_string().into_bytes()
    }
}

/// A topic of a controller: as the scenes have it, fingers count from 0 and IDs from 1.
pub fn topic(id: u8, kind: &str) -> String {
    format!("/finger{}/{kind}", id.saturating_sub(1))
}

/// Identity of a controller, for the metadata of a recording and of its channels.
pub fn device(client: &mut Client) -> Result<About, Error> {
    let (pong, information) = (client.ping()?, client.number(address::MODEL_INFORMATION)?);
    let entries = [
        ("model_number", pong.model.to_string()),
        ("id", pong.id.to_string()),
        ("firmware", format!("{}.{}", pong.firmware / 10, pong.firmware % 10)),
        ("control_table", (information >> 16).to_string()),
        ("tool", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    Ok(entries.map(|(name, value)| (name.to_owned(), value)).into())
}

/// The scene's scalars that a controller knows: name, description and value.
fn scalars(time_s: f64, state: &State) -> [(&'static str, &'static str, Value); 13] {
    let thousandth = |value: i64| json!(value as f64 * 1e-3);
    let confidence_percent = json!(state.confidence as f64 / 2.55);
    [
        ("time_s", "The controller's time from the first state", json!(time_s)),
        ("goal_n", "The force asked for", thousandth(state.goal_mn)),
        ("sensed_force_n", "Normal force as the controller senses it", thousandth(state.force_mn)),
        ("indentation_mm", "Indentation of the tip, by the model", thousandth(state.indentation_um)),
        ("travel_mm", "Way of the tip since torque was enabled", thousandth(state.travel_um)),
        ("speed_mm_per_s", "Speed of the tip", thousandth(state.speed_um_per_s)),
        ("duty_percent", "Share of the supply at the motor; positive presses", json!(state.duty_permille as f64 * 0.1)),
        ("centre_x_mm", "Sensed centre of the contact along the columns", thousandth(state.centre_x_um)),
        ("centre_y_mm", "Sensed centre of the contact along the rows", thousandth(state.centre_y_um)),
        ("confidence_percent", "Confidence that the contact is a tip on a plane", confidence_percent),
        ("mode", "Mode, by its number on the bus", json!(state.mode)),
        ("fault", "Fault, by its number on the bus; 0 is none", json!(state.fault)),
        ("limits", "Limits, a bit each as on the bus", json!(state.limits)),
    ]
}
