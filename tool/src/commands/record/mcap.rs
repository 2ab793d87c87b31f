//! MCAP with the messages of [`crate::messages`].

use super::Sink;
use crate::messages::Topic;
use crate::state::State;
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};

pub(super) struct Mcap {
    out: Writer<BufWriter<File>>,
    channels: Vec<(Topic, u16)>,
    sequence: u32,
}

fn failed(why: McapError) -> io::Error {
    match why {
        McapError::Io(why) => why,
        other => io::Error::other(other),
    }
}

impl Mcap {
    pub fn new(file: File, id: u8, pressures: bool) -> io::Result<Self> {
        let options = WriteOptions::new().profile("").library(concat!("fingertip/", env!("CARGO_PKG_VERSION")));
        let mut out = options.create(BufWriter::new(file)).map_err(failed)?;
        let topics = [Some(Topic::Scalars), pressures.then_some(Topic::Image)];
        let channel = |topic: Topic| {
            let schema = out.add_schema(topic.schema_name(), "jsonschema", &topic.schema())?;
            Ok((topic, out.add_channel(schema, &topic.name(id), "json", &BTreeMap::new())?))
        };
        let channels = topics.into_iter().flatten().map(channel).collect::<Result<_, _>>().map_err(failed)?;
        Ok(Self { out, channels, sequence: 0 })
    }
}

impl Sink for Mcap {
    fn put(&mut self, time_s: f64, state: &State) -> io::Result<()> {
        let log_time = (time_s * 1e9).round() as u64;
        for (topic, channel_id) in &self.channels {
            let header =
                MessageHeader { channel_id: *channel_id, sequence: self.sequence, log_time, publish_time: log_time };
            self.out.write_to_known_channel(&header, &topic.message(time_s, state)).map_err(failed)?;
        }
        self.sequence += 1;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.finish().map(drop).map_err(failed)
    }
}
