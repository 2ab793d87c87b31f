//! MCAP with the messages of [`crate::messages`].

use super::Sink;
use crate::messages::Topic;
use crate::state::{Stamp, State};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Seek as _, Write};

pub(super) struct Mcap {
    out: Writer<NoSeek<Chunks>>,
    channels: Vec<(Topic, u16)>,
    sequence: u32,
}

/// Chunks on their way to a file, or to standard output without one. In a file the end of an MCAP file without a summary
/// follows each chunk, by the same call of the system, and the next chunk takes its place: a program that is killed leaves
/// a file that every reader opens.
struct Chunks {
    file: Option<File>,
    buffer: Vec<u8>,
}

impl Chunks {
    fn hand_on(&mut self, end: &[u8]) -> io::Result<()> {
        if let Some(file) = &mut self.file {
            self.buffer.extend(end);
            file.write_all(&self.buffer)?;
            file.seek_relative(-(end.len() as i64))?;
        } else {
            io::stdout().write_all(&self.buffer)?;
            io::stdout().flush()?;
        }
        self.buffer.clear();
        Ok(())
    }
}

impl Write for Chunks {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend(bytes);
        Ok(bytes.len())
    }

    /// `DataEnd` (15) without a checksum, `Footer` (2) without a summary, each with its length, and the magic.
    fn flush(&mut self) -> io::Result<()> {
        let records = [&[15, 4, 0, 0, 0, 0, 0, 0, 0][..], &[0; 4], &[2, 20, 0, 0, 0, 0, 0, 0, 0], &[0; 20]];
        self.hand_on(&[&records.concat(), mcap::MAGIC].concat())
    }
}

fn failed(why: McapError) -> io::Error {
    match why {
        McapError::Io(why) => why,
        other => io::Error::other(other),
    }
}

impl Mcap {
    /// Into a file, or to standard output.
    pub fn new(file: Option<File>, id: u8, device: BTreeMap<String, String>, pressures: bool) -> io::Result<Self> {
        Self::begin(Chunks { file, buffer: Vec::new() }, id, device, pressures).map_err(failed)
    }

    fn begin(to: Chunks, id: u8, device: BTreeMap<String, String>, pressures: bool) -> mcap::McapResult<Self> {
        let options = WriteOptions::new().profile("").library(concat!("fingertip/", env!("CARGO_PKG_VERSION")));
        let mut out = options.disable_seeking(true).create(NoSeek::new(to))?;
        let metadata = Metadata { name: "fingertip.device".into(), metadata: device };
        out.write_metadata(&metadata)?;
        let topics = [Some(Topic::Scalars), pressures.then_some(Topic::Image)];
        let channel = |topic: Topic| {
            let schema = out.add_schema(topic.schema_name(), "jsonschema", &topic.schema())?;
            Ok((topic, out.add_channel(schema, &topic.name(id), "json", &metadata.metadata)?))
        };
        let channels = topics.into_iter().flatten().map(channel).collect::<mcap::McapResult<_>>()?;
        Ok(Self { out, channels, sequence: 0 })
    }
}

impl Sink for Mcap {
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()> {
        let (sequence, log_time, publish_time) = (self.sequence, stamp.read_ns, stamp.frame_ns);
        for (topic, channel_id) in &self.channels {
            let header = MessageHeader { channel_id: *channel_id, sequence, log_time, publish_time };
            self.out.write_to_known_channel(&header, &topic.message(stamp, state)).map_err(failed)?;
        }
        self.sequence += 1;
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush().map_err(failed)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.finish().map_err(failed)?;
        let mut chunks = self.out.into_inner().into_inner();
        chunks.hand_on(&[])?;
        // The library may have flushed behind the summary.
        chunks.file.map_or(Ok(()), |mut file| file.stream_position().and_then(|end| file.set_len(end)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mcap::{MessageStream, Summary};

    #[test]
    fn a_file_is_whole_after_every_flush() {
        let path = std::env::temp_dir().join(format!("fingertip-flushed-{}.mcap", std::process::id()));
        let file = File::create(&path).expect("a file");
        let mut sink = Box::new(Mcap::new(Some(file), 1, BTreeMap::new(), true).expect("it can be written"));
        let read = || {
            let bytes = std::fs::read(&path).expect("it is there");
            let messages = MessageStream::new(&bytes).expect("MCAP").map(|message| message.expect("whole").sequence);
            (messages.collect::<Vec<_>>(), Summary::read(&bytes).expect("MCAP").is_some())
        };
        for count in 1..=20 {
            sink.put(&Stamp::default(), &State::default()).expect("it can be written");
            sink.flush().expect("it can be written");
            assert_eq!(read(), ((0..count).flat_map(|n| [n, n]).collect(), false));
        }
        sink.finish().expect("it can be written");
        assert_eq!(read(), ((0..20).flat_map(|n| [n, n]).collect(), true));
        assert!(
            std::fs::read(&path).is_ok_and(|bytes| bytes.windows(8).filter(|eight| *eight == mcap::MAGIC).count() == 2)
        );
        std::fs::remove_file(&path).expect("it is there");
    }
}
