//! The image's log as text, by the table in its ELF.

use crate::error::Error;
use crate::log::Frames;
use crate::rig::Rig;
use defmt_decoder::{DecodeError, Table};

/// A line that the image logged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLine {
    /// Virtual time at which it was read, ns.
    pub at_ns: u64,
    /// Level, if it has one.
    pub level: Option<String>,
    /// The image's own timestamp and its text.
    pub text: String,
}

impl Rig {
    /// The image's log so far; one without a log has none.
    ///
    /// # Errors
    /// The emulator stopped, or the image has a log that this crate cannot decode.
    pub fn log(&mut self) -> Result<Vec<LogLine>, Error> {
        let frames = self.with(|stand| {
            stand.bench.log.drain(stand.bench.next_ns, stand.host);
            stand.bench.log.frames().to_vec()
        })?;
        let image = self.image();
        let table = Table::parse(image.elf()).map_err(|why| Error::NotAnImage {
            path: image.path().into(),
            why: format!("its defmt table cannot be read: {why}"),
        })?;
        Ok(table.map_or_else(Vec::new, |table| frames.iter().flat_map(|frames| decode(&table, frames)).collect()))
    }
}

fn decode(table: &Table, frames: &Frames) -> Vec<LogLine> {
    let mut decoder = table.new_stream_decoder();
    decoder.received(&frames.bytes);
    let mut lines = Vec::new();
    loop {
        let (level, text) = match decoder.decode() {
            Ok(frame) => {
                let time = frame.display_timestamp().map(|time| format!("{time} ")).unwrap_or_default();
                (frame.level().map(|level| level.as_str().to_owned()), format!("{time}{}", frame.display_message()))
            }
            Err(DecodeError::UnexpectedEof) => return lines,
            Err(DecodeError::Malformed) => (None, "(a damaged log frame)".to_owned()),
        };
        lines.push(LogLine { at_ns: frames.at_ns, level, text });
    }
}
