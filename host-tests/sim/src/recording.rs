//! Recordings: MCAP files that Foxglove and PlotJuggler open without a plugin, and that replay to the bit.
//!
//! | topic | schema | rate | contents |
//! | --- | --- | --- | --- |
//! | `/finger0/scalars` | `fingertip.Scalars` | each `every`-th step | sensed and true values, each with its unit in its name |
//! | `/finger0/frame` | `fingertip.Frame` | 100 per second | codes of the frame, `[slot][column]` |
//! | `/finger0/image` | `foxglove.RawImage` | 100 per second | the same codes as a grey image |
//! | `/finger0/core` | `fingertip.Core` | each step | inputs of the core, byte for byte, and a digest of its outputs |
//!
//! The text of the scene is attached, and the parameters of the controllers are metadata: a replay needs no other file.
//! A recording of the emulated board shows it from outside, with a step each millisecond: it cannot be replayed and
//! says so.

use crate::metrics::duty;
use crate::part::cannot_write;
use crate::run::RunError;
use crate::scene::Scene;
use crate::watch::{Controller, Step, Watch};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Calibration, Config, Pipeline, ROWS, SLOTS};
use images::record::{Digest, Record};
use mcap::read::Options;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, McapResult, MessageStream, WriteOptions, Writer};
use output::kept::Whole;
pub use replay::file::check;
use replay::file::{self, metadata};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Metadata record of the scene and the controllers, and the one at the end of a complete recording.
const SETUP: &str = "fingertip.setup";
const END: &str = "fingertip.end";
/// Entry that states if a replay is possible.
const WHOLE: &str = "whole";

fn topic(finger: usize, what: &str) -> String {
    format!("/finger{finger}/{what}")
}

/// A controller as JSON: its parameters by name, its calibration by taxel.
fn controller_json(controller: &Controller) -> Value {
    let names = Params::RANGES.iter().map(|(name, ..)| (*name).to_owned());
    let params: Map<String, Value> = names.zip(controller.params.to_array().map(Value::from)).collect();
    json!({ "params": params, "calibration": controller.calibration })
}

/// Inverse of [`controller_json`]; none if a value is missing or of another type.
fn controller_of(value: &Value) -> Option<Controller> {
    let mut values = [0; Params::COUNT];
    for ((name, ..), place) in Params::RANGES.iter().zip(&mut values) {
        *place = value["params"][name].as_i64()?.try_into().ok()?;
    }
    let calibration = serde_json::from_value(value["calibration"].clone()).ok()?;
    Some(Controller { params: Params::from_array(&values), calibration })
}

/// Last part of each topic, name of its schema, and schema.
pub fn schemas() -> [(&'static str, &'static str, String); 4] {
    let scalar = |(name, about, _): &Scalar| ((*name).to_owned(), json!({ "type": "number", "description": about }));
    let scalars: Map<_, _> = SCALARS.iter().map(scalar).collect();
    let record = "Frame, sense and command in the layout of images::record::Record, base64";
    let digest = "CRC-64/XZ of the duty and of every field of the status, hexadecimal";
    let core = json!({
        "record": { "type": "string", "contentEncoding": "base64", "description": record },
        "duty": { "type": "integer", "description": "The duty that the core answered, Q15" },
        "digest": { "type": "string", "description": digest },
    });
    let object = |title, properties: Value| json!({ "title": title, "type": "object", "properties": properties });
    let of = |what, title: &'static str, properties| (what, title, object(title, properties).to_string());
    [
        of("scalars", "fingertip.Scalars", scalars.into()),
        ("frame", "fingertip.Frame", include_str!("../../../tool/src/messages/frame.json").into()),
        ("image", "foxglove.RawImage", include_str!("../../../tool/src/messages/raw_image.json").into()),
        of("core", "fingertip.Core", core),
    ]
}

type Scalar = (&'static str, &'static str, fn(&Step) -> f64);

pub const SCALARS: [Scalar; 20] = [
    ("time_s", "Virtual time from the scene's start", |s| s.time_s),
    ("goal_n", "Requested force", |s| s.command.goal.0.to_num()),
    ("sensed_force_n", "Normal force as the controller senses it", |s| s.status.contact.force.0.to_num()),
    ("true_force_n", "Normal force between tip and object", |s| s.truth.force_n),
    ("indentation_mm", "Indentation of the tip", |s| s.truth.indentation_mm),
    ("travel_mm", "Travel of the tip from its start", |s| s.truth.travel_mm),
    ("speed_mm_per_s", "Speed of the tip", |s| s.truth.speed_mm_per_s),
    ("duty_percent", "Share of the supply at the motor; positive presses", |s| 100.0 * duty(s.status.duty)),
    ("current_a", "Winding current", |s| s.truth.current_a),
    ("supply_v", "Supply at the bridge", |s| s.truth.supply_v),
    ("winding_c", "Temperature of the winding", |s| s.truth.winding_c),
    ("centre_x_mm", "Sensed centre of the contact along the columns", |s| s.status.contact.centre_x.0.to_num()),
    ("centre_y_mm", "Sensed centre of the contact along the rows", |s| s.status.contact.centre_y.0.to_num()),
    ("confidence_percent", "Confidence that the contact is a tip on a plane", |s| {
        f64::from(s.status.contact.confidence) / 2.55
    }),
    ("mode", "Mode, by its number on the bus", |s| f64::from(s.status.mode as u8)),
    ("fault", "Fault, by its number on the bus; 0 without one", |s| {
        f64::from(s.status.fault.map_or(0, |fault| fault as u8))
    }),
    ("limits", "Limits, a bit each as on the bus", |s| f64::from(s.status.limits.0)),
    ("tangential_n", "Tangential force on the object, upwards", |s| s.truth.tangential_n),
    ("slip_mm", "Distance that the contact has slipped", |s| s.truth.slip_mm),
    ("object_height_mm", "Height of the object", |s| s.truth.object_mm[1]),
];

#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Steps of all fingers, up to the first difference.
    pub steps: u64,
    /// Description of the first answer of the core that differs.
    pub difference: Option<String>,
}

#[derive(Deserialize)]
struct Core {
    record: String,
    duty: i16,
    digest: String,
}

pub fn replay(path: &Path) -> Result<Replay, RunError> {
    let bytes = fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    replay_bytes(&bytes).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn replay_bytes(bytes: &[u8]) -> Result<Replay, RunError> {
    check(bytes)?;
    let setup = metadata(bytes, SETUP)?;
    if setup.metadata.get(WHOLE).is_some_and(|whole| whole == "false") {
        let message = "a recording of the emulated board: what its core was given is not all in it, so it cannot be fed \
                       through the core again";
        return Err(message.into());
    }
    let end = metadata(bytes, END)?;
    let field = |of: &Metadata, name: &str| {
        let found = of.metadata.get(name).cloned();
        found.ok_or_else(|| format!("{} has no {name}: not a recording of this version", of.name))
    };
    let fingers: usize = field(&setup, "fingers")?.parse()?;
    let mut cores = Vec::new();
    for number in 0..fingers {
        let text = field(&setup, &format!("finger{number}"))?;
        let controller = controller_of(&serde_json::from_str(&text)?)
            .ok_or_else(|| format!("the parameters of finger {number} are not those of this version"))?;
        let config = Config::shipped(&controller.params).map_err(|error| format!("finger {number}: {error}"))?;
        let mut pipeline = Pipeline::new(&config);
        if let Some(gains) = &controller.calibration {
            pipeline.calibrate(&Calibration::new(gains, &[0; ROWS])?);
        }
        cores.push((topic(number, "core"), pipeline, 0));
    }
    let mut steps = 0;
    for message in MessageStream::new_with_options(bytes, Options::ValidateChunkCrcs.into())? {
        let message = message?;
        let found = cores.iter_mut().enumerate().find(|(_, (topic, ..))| *topic == message.channel.topic);
        let Some((finger, (_, pipeline, frame))) = found else { continue };
        let core: Core = serde_json::from_slice(&message.data)?;
        let record = BASE64_STANDARD.decode(&core.record)?;
        let record: [u8; Record::BYTES] =
            record.try_into().map_err(|_| format!("finger {finger}, frame {frame}: a record of another length"))?;
        let Record { frame: codes, sense, command } = Record::from_bytes(&record);
        let (duty, status) = pipeline.step(&codes, &sense, &command);
        let mut digest = Digest::new();
        digest.add(duty, status);
        let (recorded, replayed) = ((core.duty, core.digest), (duty.0, format!("{:016x}", digest.value())));
        if recorded != replayed {
            let ms = message.log_time as f64 * 1e-6;
            let difference = format!(
                "finger {finger} differs first at frame {frame}, {ms:.3} ms in: recorded duty {} and digest {}, replayed duty {} and digest {}",
                recorded.0, recorded.1, replayed.0, replayed.1
            );
            return Ok(Replay { steps, difference: Some(difference) });
        }
        *frame += 1;
        steps += 1;
    }
    for (number, (_, _, frames)) in cores.iter().enumerate() {
        let promised = field(&end, &format!("finger{number}.steps"))?;
        if promised != frames.to_string() {
            return Err(format!("finger {number} has {frames} frames where {promised} were recorded").into());
        }
    }
    Ok(Replay { steps, difference: None })
}

/// Time between two frames that are recorded as arrays and images.
const FRAME_S: f64 = 0.01;
/// Codes per grey level: 2040 codes are white.
const CODES_PER_GREY: u16 = 8;

pub struct Recorder {
    path: PathBuf,
    out: Writer<BufWriter<Whole>>,
    scene: Scene,
    every: u64,
    whole: bool,
    fingers: Vec<Finger>,
    start_s: Option<f64>,
    /// First failure. Nothing is written after it.
    failed: McapResult<()>,
}

#[derive(Default)]
struct Finger {
    channels: [u16; 4],
    steps: u64,
    next_frame_s: f64,
}

impl Recorder {
    /// Records into a new file, which appears under its name when it is finished, with the scalars of each `every`-th
    /// step. The steps of a board that is seen from outside are not `whole`: they lack inputs of the core, so a replay is
    /// impossible.
    pub fn new(path: &Path, scene: &Scene, every: u64, whole: bool) -> Result<Self, RunError> {
        let file = Whole::create(path).map_err(|error| cannot_write(path, &error))?;
        let library = concat!("fingertip-sim/", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().profile("").library(library).compression(Some(Compression::Lz4));
        Ok(Self {
            path: path.into(),
            out: options.create(BufWriter::new(file))?,
            scene: scene.clone(),
            every: every.max(1),
            whole,
            fingers: Vec::new(),
            start_s: None,
            failed: Ok(()),
        })
    }

    /// Closes the file after the run and moves it to its place. After a failure an earlier file remains.
    pub fn finish(mut self, digest: &str) -> Result<(), RunError> {
        let path = std::mem::take(&mut self.path);
        if self.fingers.is_empty() && self.failed.is_ok() {
            return Err("the board did not say how its controllers are set: nothing to replay".into());
        }
        Ok(self.close(digest).map_err(|error| match error {
            McapError::Io(error) => cannot_write(&path, &error),
            error => format!("cannot write {}: {error}", path.display()),
        })?)
    }

    fn close(mut self, digest: &str) -> McapResult<()> {
        self.failed?;
        let steps =
            self.fingers.iter().enumerate().map(|(n, finger)| (format!("finger{n}.steps"), finger.steps.to_string()));
        let metadata = steps.chain([("digest".to_owned(), digest.to_owned())]).collect();
        self.out.write_metadata(&Metadata { name: END.into(), metadata })?;
        self.out.finish()?;
        let file = self.out.into_inner().into_inner().map_err(io::IntoInnerError::into_error)?;
        Ok(file.finish()?)
    }

    fn write_head(&mut self, controllers: &[Controller]) -> McapResult<()> {
        let out = &mut self.out;
        out.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: format!("{}.toml", self.scene.name),
            media_type: "application/toml".into(),
            data: self.scene.text.as_bytes().into(),
        })?;
        let mut metadata = BTreeMap::from([
            ("scene".to_owned(), self.scene.name.clone()),
            ("seed".to_owned(), self.scene.seed.to_string()),
            ("simulated".to_owned(), "true".to_owned()),
            (WHOLE.to_owned(), self.whole.to_string()),
            ("fingers".to_owned(), controllers.len().to_string()),
        ]);
        for (number, controller) in controllers.iter().enumerate() {
            metadata.insert(format!("finger{number}"), controller_json(controller).to_string());
        }
        out.write_metadata(&Metadata { name: SETUP.into(), metadata })?;
        let schemas = schemas();
        let mut ids = [0; 4];
        for ((_, name, schema), id) in schemas.iter().zip(&mut ids) {
            *id = out.add_schema(name, "jsonschema", schema.as_bytes())?;
        }
        for number in 0..controllers.len() {
            let mut finger = Finger { next_frame_s: f64::NEG_INFINITY, ..Finger::default() };
            for (((what, ..), id), channel) in schemas.iter().zip(ids).zip(&mut finger.channels) {
                *channel = out.add_channel(id, &topic(number, what), "json", &BTreeMap::new())?;
            }
            self.fingers.push(finger);
        }
        Ok(())
    }

    fn write_step(&mut self, step: &Step) -> McapResult<()> {
        let since_s = step.time_s - *self.start_s.get_or_insert(step.time_s);
        let log_time = (since_s * 1e9 + 0.5) as u64;
        let Some(finger) = self.fingers.get_mut(step.finger) else { return Ok(()) };
        let [scalars_channel, frame_channel, image_channel, core_channel] = finger.channels;
        let sequence = finger.steps as u32;
        let out = &mut self.out;
        let mut put = |channel_id, message: &Value| {
            let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
            out.write_to_known_channel(&header, message.to_string().as_bytes())
        };
        if finger.steps.is_multiple_of(self.every) {
            put(scalars_channel, &scalars(step))?;
        }
        if step.time_s >= finger.next_frame_s {
            finger.next_frame_s = step.time_s + FRAME_S;
            let codes: Vec<Vec<u16>> =
                (0..SLOTS).map(|slot| (0..COLUMNS).map(|column| step.frame.code(slot, column)).collect()).collect();
            put(frame_channel, &json!({ "sequence": step.frame.sequence, "codes": codes }))?;
            put(image_channel, &image(step, log_time))?;
        }
        finger.steps += 1;
        put(core_channel, &core(step))
    }
}

impl Watch for Recorder {
    fn begin(&mut self, controllers: &[Controller]) {
        self.failed = self.write_head(controllers);
    }

    fn step(&mut self, step: &Step) {
        if self.failed.is_ok() {
            self.failed = self.write_step(step);
        }
    }
}

fn scalars(step: &Step) -> Value {
    let values = SCALARS.iter().map(|(name, _, value)| ((*name).to_owned(), value(step).into()));
    Value::Object(values.collect())
}

/// Codes of the taxels in grey.
fn image(step: &Step, log_time: u64) -> Value {
    let grey = |code: u16| (code / CODES_PER_GREY).min(255) as u8;
    let rows = (0..ROWS).map(|row| (0..COLUMNS).map(|column| grey(step.frame.code(row, column))).collect());
    file::image(log_time, &format!("finger{}", step.finger), &rows.collect::<Vec<_>>())
}

fn core(step: &Step) -> Value {
    let record = Record { frame: *step.frame, sense: *step.sense, command: *step.command };
    let mut digest = Digest::new();
    digest.add(step.status.duty, step.status);
    json!({
        "record": BASE64_STANDARD.encode(record.to_bytes()),
        "duty": step.status.duty.0,
        "digest": format!("{:016x}", digest.value()),
    })
}
