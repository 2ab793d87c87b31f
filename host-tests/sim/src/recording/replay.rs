//! Feeds a recording through the core again; the answers must be the same to the bit.

use super::{END, OF_SCENE, OF_SETUP, SETUP, WHOLE, check, controller_of, digest, texts, topic};
use crate::run::RunError;
use base64::prelude::{BASE64_STANDARD, Engine as _};
use fingertip::shipped::{Calibration, Config, Pipeline};
use images::record::{Digest, Record};
use mcap::read::Options;
use mcap::records::Metadata;
use mcap::{Attachment, McapResult, MessageStream};
use serde::Deserialize;
use std::fmt;
use std::fs;
use std::path::Path;

/// A recording that was fed through the core again.
#[derive(Clone, Debug, PartialEq)]
pub struct Replay {
    /// Steps of all fingers together, up to the first difference.
    pub steps: u64,
    /// Where the core answered otherwise first.
    pub difference: Option<Difference>,
}

/// Where a replay leaves its recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Which finger.
    pub finger: usize,
    /// Its frame, from 0.
    pub frame: u64,
    /// Nanoseconds after the recording's first step.
    pub time_ns: u64,
    /// Duty and digest as they were recorded.
    pub recorded: (i16, String),
    /// Duty and digest of the replay.
    pub replayed: (i16, String),
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { finger, frame, time_ns, recorded, replayed } = self;
        let ms = *time_ns as f64 * 1e-6;
        write!(f, "finger {finger} differs first at frame {frame}, {ms:.3} ms in: ")?;
        write!(f, "recorded duty {} and digest {}, ", recorded.0, recorded.1)?;
        write!(f, "replayed duty {} and digest {}", replayed.0, replayed.1)
    }
}

/// A message of the topic `core`.
#[derive(Deserialize)]
struct Core {
    record: String,
    duty: i16,
    digest: String,
}

/// Replays a file.
///
/// # Errors
/// The file cannot be read, is damaged, or is no whole recording of this project.
pub fn replay(path: &Path) -> Result<Replay, RunError> {
    let bytes = fs::read(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?;
    replay_bytes(&bytes).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn replay_bytes(bytes: &[u8]) -> Result<Replay, RunError> {
    check(bytes)?;
    let setup = metadata(bytes, SETUP)?;
    if setup.metadata.get(WHOLE).is_some_and(|whole| whole == "false") {
        return Err(
            "a recording of the emulated board: what its core was given is not all in it, so it cannot be fed \
                    through the core again"
                .into(),
        );
    }
    let end = metadata(bytes, END)?;
    let field = |of: &Metadata, name: &str| {
        of.metadata
            .get(name)
            .cloned()
            .ok_or_else(|| format!("{} has no {name}: not a recording of this version", of.name))
    };
    // The file is whole, but a program may have written it anew with other contents.
    if field(&end, OF_SETUP)? != digest(&setup.metadata) {
        return Err(format!("its {SETUP}, how the controllers were set, was changed after the run").into());
    }
    if field(&end, OF_SCENE)? != texts(scene(bytes)?.iter().map(|scene| &scene.data[..])) {
        return Err("the attached scene was changed after the run, or is missing".into());
    }
    let fingers: usize = field(&setup, "fingers")?.parse()?;
    let mut cores = Vec::new();
    for number in 0..fingers {
        let text = field(&setup, &format!("finger{number}"))?;
        let controller = controller_of(&serde_json::from_str(&text)?)
            .ok_or_else(|| format!("the parameters of finger {number} are not those of this version"))?;
        let config = Config::shipped(&controller.params).map_err(|error| format!("finger {number}: {error}"))?;
        let mut pipeline = Pipeline::new(&config);
        if let Some(gains) = &controller.calibration {
            pipeline.calibrate(&Calibration::new(&gains.gains_q14, &gains.masks)?);
        }
        cores.push((topic(number, "core"), pipeline, 0));
    }
    let mut steps = 0;
    for message in messages(bytes)? {
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
            let difference = Difference { finger, frame: *frame, time_ns: message.log_time, recorded, replayed };
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

fn messages(bytes: &[u8]) -> McapResult<MessageStream<'_>> {
    MessageStream::new_with_options(bytes, Options::ValidateChunkCrcs.into())
}

/// What is attached.
fn scene(bytes: &[u8]) -> Result<Vec<Attachment<'_>>, RunError> {
    let summary = mcap::Summary::read(bytes)?.ok_or("the file has no summary")?;
    Ok(summary
        .attachment_indexes
        .iter()
        .map(|index| mcap::read::attachment(bytes, index))
        .collect::<McapResult<_>>()?)
}

fn metadata(bytes: &[u8], name: &str) -> Result<Metadata, RunError> {
    let summary = mcap::Summary::read(bytes)?.ok_or("the file has no summary: the recording was cut off")?;
    let index = summary.metadata_indexes.iter().find(|index| index.name == name);
    let index = index.ok_or_else(|| format!("no {name} in the file: not a whole recording of this project"))?;
    Ok(mcap::read::metadata(bytes, index)?)
}
