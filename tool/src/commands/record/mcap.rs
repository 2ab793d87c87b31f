//! MCAP with the topics and the names of the scenes' recordings, so that what shows those shows these: the numbers as
//! `fingertip.Scalars`, the pressures as a picture in grey.

use super::Sink;
use crate::state::{SHAPE, State};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// The names of a scene's scalars that a controller knows, and what they are.
const SCALARS: [(&str, &str); 13] = [
    ("time_s", "The controller's time from the first state"),
    ("goal_n", "The force asked for"),
    ("sensed_force_n", "Normal force as the controller senses it"),
    ("indentation_mm", "Indentation of the tip, by the model"),
    ("travel_mm", "Way of the tip since torque was enabled"),
    ("speed_mm_per_s", "Speed of the tip"),
    ("duty_percent", "Share of the supply at the motor; positive presses"),
    ("centre_x_mm", "Sensed centre of the contact along the columns"),
    ("centre_y_mm", "Sensed centre of the contact along the rows"),
    ("confidence_percent", "Confidence that the contact is a tip on a plane"),
    ("mode", "Mode, by its number on the bus"),
    ("fault", "Fault, by its number on the bus; 0 is none"),
    ("limits", "Limits, a bit each as on the bus"),
];
/// Pa for a grey level: that of the scenes, 8 codes at 24 codes for a kPa.
const PA_PER_GREY: i64 = 333;

pub(super) struct Mcap {
    out: Writer<BufWriter<File>>,
    scalars: u16,
    image: Option<u16>,
    sequence: u32,
}

fn failed(why: McapError) -> io::Error {
    match why {
        McapError::Io(why) => why,
        other => io::Error::other(other),
    }
}

impl Mcap {
    pub fn new(path: &Path, id: u8, pressures: bool) -> io::Result<Self> {
        let options = WriteOptions::new().profile("").library(concat!("fingertip/", env!("CARGO_PKG_VERSION")));
        let mut out = options.create(BufWriter::new(File::create(path)?)).map_err(failed)?;
        let mut channel = |topic: &str, name: &str, schema: &Value| {
            let schema = out.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
            out.add_channel(schema, &format!("/finger{}/{topic}", id.saturating_sub(1)), "json", &BTreeMap::new())
        };
        let scalars = channel("scalars", "fingertip.Scalars", &scalars_schema()).map_err(failed)?;
        let image = pressures.then(|| channel("image", "foxglove.RawImage", &image_schema())).transpose();
        Ok(Self { image: image.map_err(failed)?, out, scalars, sequence: 0 })
    }

    fn write(&mut self, channel_id: u16, time_s: f64, message: &Value) -> io::Result<()> {
        let log_time = (time_s * 1e9).round() as u64;
        let header = MessageHeader { channel_id, sequence: self.sequence, log_time, publish_time: log_time };
        self.out.write_to_known_channel(&header, message.to_string().as_bytes()).map_err(failed)
    }
}

impl Sink for Mcap {
    fn put(&mut self, time_s: f64, state: &State) -> io::Result<()> {
        let thousandth = |value: i64| value as f64 * 1e-3;
        let values = [
            json!(time_s),
            json!(thousandth(state.goal_mn)),
            json!(thousandth(state.force_mn)),
            json!(thousandth(state.indentation_um)),
            json!(thousandth(state.travel_um)),
            json!(thousandth(state.speed_um_per_s)),
            json!(state.duty_permille as f64 * 0.1),
            json!(thousandth(state.centre_x_um)),
            json!(thousandth(state.centre_y_um)),
            json!(state.confidence as f64 / 2.55),
            json!(state.mode),
            json!(state.fault),
            json!(state.limits),
        ];
        let names = SCALARS.iter().map(|(name, _)| (*name).to_owned());
        let message = Value::Object(names.zip(values).collect::<Map<_, _>>());
        self.write(self.scalars, time_s, &message)?;
        if let Some(image) = self.image {
            let [rows, columns] = SHAPE;
            let grey = |pa: &i64| (pa / PA_PER_GREY).clamp(0, 255) as u8;
            // The last row on top.
            let data: Vec<u8> = state.pressures_pa.chunks(columns).rev().flatten().map(grey).collect();
            let message = json!({
                "timestamp": { "sec": time_s as u64, "nsec": (time_s.fract() * 1e9) as u32 },
                "frame_id": "array", "width": columns, "height": rows, "encoding": "mono8", "step": columns,
                "data": BASE64_STANDARD.encode(data),
            });
            self.write(image, time_s, &message)?;
        }
        self.sequence += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.finish().map(drop).map_err(failed)
    }
}

fn scalars_schema() -> Value {
    let number = |about: &str| json!({ "type": "number", "description": about });
    let properties: Map<_, _> = SCALARS.iter().map(|(name, about)| ((*name).to_owned(), number(about))).collect();
    json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties })
}

/// As <https://docs.foxglove.dev/docs/sdk/schemas/raw-image> has it.
fn image_schema() -> Value {
    let count = json!({ "type": "integer", "minimum": 0 });
    json!({
        "title": "foxglove.RawImage",
        "type": "object",
        "properties": {
            "timestamp": { "type": "object", "title": "time", "properties": { "sec": count, "nsec": count } },
            "frame_id": { "type": "string" },
            "width": count,
            "height": count,
            "encoding": { "type": "string" },
            "step": count,
            "data": { "type": "string", "contentEncoding": "base64" },
        },
    })
}
