//! A state as messages for what shows recordings: the topics and the names of the scenes', so that what shows those
//! shows these (`tests/messages.rs`). The numbers are `fingertip.Scalars`, the pressures a grey image.

use crate::state::{SHAPE, Stamp, State};
use crate::{Client, Error};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::shipped::address;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::{Seek, Write};

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
/// Schema of <https://docs.foxglove.dev/docs/sdk/schemas/raw-image>; recordings of scenes include the same file.
const IMAGE_SCHEMA: &str = include_str!("messages/raw_image.json");
/// Pa for a grey level: that of the scenes, 8 codes at 24 codes for a kPa.
const PA_PER_GREY: i64 = 333;

/// A kind of message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The numbers.
    Scalars,
    /// The pressures.
    Image,
}

impl Topic {
    /// Name of the topic for a controller.
    pub fn name(self, id: u8) -> String {
        let kind = match self {
            Self::Scalars => "scalars",
            Self::Image => "image",
        };
        topic(id, kind)
    }

    /// Name of the topic's schema.
    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Scalars => "fingertip.Scalars",
            Self::Image => "foxglove.RawImage",
        }
    }

    /// Schema of the topic, as JSON Schema.
    pub fn schema(self) -> Vec<u8> {
        let number = |(name, about): (&str, &str)| (name.to_owned(), json!({ "type": "number", "description": about }));
        match self {
            Self::Scalars => {
                let properties: Map<_, _> = SCALARS.map(number).into_iter().collect();
                let schema = json!({ "title": "fingertip.Scalars", "type": "object", "properties": properties });
                schema.to_string().into_bytes()
            }
            Self::Image => IMAGE_SCHEMA.into(),
        }
    }

    /// Adds the topic of a controller to a file.
    pub fn add_to<W: Write + Seek>(
        self,
        out: &mut mcap::Writer<W>,
        id: u8,
        device: &BTreeMap<String, String>,
    ) -> mcap::McapResult<u16> {
        let schema = out.add_schema(self.schema_name(), "jsonschema", &self.schema())?;
        out.add_channel(schema, &self.name(id), "json", device)
    }

    /// A state's message, in JSON.
    pub fn message(self, stamp: &Stamp, state: &State) -> Vec<u8> {
        let message = match self {
            Self::Scalars => scalars(stamp.time_s, state),
            Self::Image => image(stamp.frame_ns, state),
        };
        message.to_string().into_bytes()
    }
}

/// A topic of a controller: as the scenes have it, fingers count from 0 and IDs from 1.
pub fn topic(id: u8, kind: &str) -> String {
    format!("/finger{}/{kind}", id.saturating_sub(1))
}

/// Identity of a controller, for the metadata of a recording and of its channels.
pub fn device(client: &mut Client) -> Result<BTreeMap<String, String>, Error> {
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

fn scalars(time_s: f64, state: &State) -> Value {
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
    Value::Object(names.zip(values).collect::<Map<_, _>>())
}

fn image(time_ns: u64, state: &State) -> Value {
    let [rows, columns] = SHAPE;
    let grey = |pa: &i64| (pa / PA_PER_GREY).clamp(0, 255) as u8;
    // The last row on top.
    let data: Vec<u8> = state.pressures_pa.chunks(columns).rev().flatten().map(grey).collect();
    json!({
        "timestamp": { "sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000 },
        "frame_id": "array", "width": columns, "height": rows, "encoding": "mono8", "step": columns,
        "data": BASE64_STANDARD.encode(data),
    })
}
