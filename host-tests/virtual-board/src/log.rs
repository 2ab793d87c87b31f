//! The image's log: defmt frames out of the RTT buffer, as a probe reads them.

use crate::error::Error;
use crate::image::Firmware;
use defmt_decoder::{DecodeError, Table};
use rigless::emulator::Host;
use rigless::soc::Width;
use serde::{Deserialize, Serialize};

/// Offsets in the RTT control block: the first up-channel's buffer, size, write and read position.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITTEN: u64 = 36;
const READ: u64 = 40;

/// A line that the image logged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogLine {
    /// When it was read out, virtual time.
    pub at_ns: u64,
    /// Level, where it has one.
    pub level: Option<String>,
    /// The image's own timestamp and its text.
    pub text: String,
}

/// Reads the log out.
#[derive(Debug, Default)]
pub struct Log {
    source: Option<(u64, Table)>,
    /// What arrived since the last whole frame.
    partial: Vec<u8>,
    /// All lines so far.
    pub lines: Vec<LogLine>,
}

impl Log {
    /// Of an image; one without a log stays silent.
    ///
    /// # Errors
    /// The image has a log that this crate cannot decode.
    pub fn new(image: &Firmware) -> Result<Self, Error> {
        let table = Table::parse(image.elf()).map_err(|why| Error::NotAnImage {
            path: image.path().into(),
            why: format!("its defmt table cannot be read: {why}"),
        })?;
        Ok(Self { source: image.symbol("_SEGGER_RTT").zip(table), ..Self::default() })
    }

    /// Takes what is in the buffer; an image that has not set it up yet has nothing.
    pub fn drain(&mut self, at_ns: u64, host: &mut dyn Host) {
        let Some((block, table)) = &self.source else { return };
        let mut word = |offset| host.read(block + offset, Width::W32).unwrap_or(0);
        let (buffer, size, written, mut read) = (word(BUFFER), word(SIZE), word(WRITTEN), word(READ));
        if buffer == 0 || written == read || written >= size || read >= size {
            return;
        }
        while read != written {
            self.partial.push(host.read(buffer + read, Width::W8).unwrap_or(0) as u8);
            read = (read + 1) % size;
        }
        if host.write(block + READ, Width::W32, read).is_err() {
            return;
        }
        let Some(end) = self.partial.iter().rposition(|byte| *byte == 0) else { return };
        let mut decoder = table.new_stream_decoder();
        decoder.received(&self.partial[..=end]);
        self.partial.drain(..=end);
        loop {
            let (level, text) = match decoder.decode() {
                Ok(frame) => {
                    let time = frame.display_timestamp().map(|time| format!("{time} ")).unwrap_or_default();
                    (frame.level().map(|level| level.as_str().to_owned()), format!("{time}{}", frame.display_message()))
                }
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => (None, "(a damaged log frame)".to_owned()),
            };
            self.lines.push(LogLine { at_ns, level, text });
        }
    }

    /// The image starts anew: what it had begun to write is gone.
    pub fn restart(&mut self) {
        self.partial.clear();
    }

    /// What a snapshot keeps.
    pub fn state(&self) -> (&[u8], &[LogLine]) {
        (&self.partial, &self.lines)
    }

    /// Puts that back.
    pub fn set_state(&mut self, partial: Vec<u8>, lines: Vec<LogLine>) {
        (self.partial, self.lines) = (partial, lines);
    }
}
