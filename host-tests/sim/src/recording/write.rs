//! Writer of recordings.

use super::{END, OF_SCENE, OF_SETUP, SCALARS, SETUP, WHOLE, controller_json, digest, schemas, texts, topic};
use crate::part::cannot_write;
use crate::run::RunError;
use crate::scene::Scene;
use crate::watch::{Controller, Step, Watch};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};
use images::record::{Digest, Record};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, McapError, McapResult, WriteOptions, Writer};
use output::kept::Whole;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Time between two frames that are recorded as arrays and images.
const FRAME_S: f64 = 0.01;
/// Codes per grey level: 2040 codes are white.
const CODES_PER_GREY: u16 = 8;

/// Records a run.
pub struct Recorder {
    path: PathBuf,
    out: Writer<BufWriter<Whole>>,
    scene: Scene,
    every: u64,
    whole: bool,
    fingers: Vec<Finger>,
    begun: bool,
    /// Digest of the record of the controllers.
    setup: String,
    start_s: Option<f64>,
    /// First failure. Nothing is written after it.
    failed: McapResult<()>,
}

#[derive(Default)]
struct Finger {
    /// Channels of scalars, frame, image and core.
    channels: [u16; 4],
    steps: u64,
    next_frame_s: f64,
}

impl Recorder {
    /// Records into a new file, which appears under its name when it is finished, with the scalars of each `every`-th
    /// step.
    pub fn new(path: &Path, scene: &Scene, every: u64) -> Result<Self, RunError> {
        let file = Whole::create(path).map_err(|error| cannot_write(path, &error))?;
        let library = concat!("fingertip-sim/", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().profile("").library(library).compression(Some(Compression::Lz4));
        Ok(Self {
            path: path.into(),
            out: options.create(BufWriter::new(file))?,
            scene: scene.clone(),
            every: every.max(1),
            whole: true,
            fingers: Vec::new(),
            begun: false,
            setup: String::new(),
            start_s: None,
            failed: Ok(()),
        })
    }

    /// Notes before the run that the steps lack inputs of the core, so a replay is impossible.
    pub fn seen_from_outside(mut self) -> Self {
        self.whole = false;
        self
    }

    /// Closes the file after the run and moves it to its place. After a failure an earlier file remains.
    pub fn finish(mut self, digest: &str) -> Result<(), RunError> {
        let path = std::mem::take(&mut self.path);
        if !self.begun {
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
        let scene = texts([self.scene.text.as_bytes()]);
        let digests = [("digest", digest.into()), (OF_SETUP, self.setup.clone()), (OF_SCENE, scene)];
        let metadata = steps.chain(digests.map(|(name, digest)| (name.to_owned(), digest))).collect();
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
        self.setup = digest(&metadata);
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
        self.begun = true;
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

/// Codes of the taxels in grey, the last row on top.
fn image(step: &Step, log_time: u64) -> Value {
    let grey = |code: u16| (code / CODES_PER_GREY).min(255) as u8;
    let rows = (0..ROWS).rev();
    let data: Vec<u8> =
        rows.flat_map(|row| (0..COLUMNS).map(move |column| grey(step.frame.code(row, column)))).collect();
    json!({
        "timestamp": { "sec": log_time / 1_000_000_000, "nsec": log_time % 1_000_000_000 },
        "frame_id": format!("finger{}", step.finger),
        "width": COLUMNS,
        "height": ROWS,
        "encoding": "mono8",
        "step": COLUMNS,
        "data": BASE64_STANDARD.encode(data),
    })
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
