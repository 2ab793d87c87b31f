//! The image's log: defmt frames out of the RTT buffer, taken out while it runs as a probe does.

use crate::image::Firmware;
use rigless::emulator::Host;
use rigless::soc::Width;

/// Offsets in the RTT control block: the first up-channel's buffer, size, write and read position.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITTEN: u64 = 36;
const READ: u64 = 40;

/// Whole frames, still encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames {
    /// Virtual time at which they were read, ns.
    pub at_ns: u64,
    /// Frames, each ended by a zero.
    pub bytes: Vec<u8>,
}

/// Reads the log out. [`text`] makes lines of it.
#[derive(Debug, Default)]
pub struct Log {
    block: Option<u64>,
    /// Bytes received since the last whole frame.
    partial: Vec<u8>,
    /// All frames so far.
    pub frames: Vec<Frames>,
}

impl Log {
    /// Log of an image; stays empty for an image without a log.
    pub fn new(image: &Firmware) -> Self {
        Self { block: image.symbol("_SEGGER_RTT"), ..Self::default() }
    }

    /// Reads the log buffer; does nothing until the image has set it up.
    pub fn drain(&mut self, at_ns: u64, host: &mut dyn Host) {
        let Some(block) = self.block else { return };
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
        self.frames.push(Frames { at_ns, bytes: self.partial.drain(..=end).collect() });
    }

    /// Drops a half-written line: the image restarts.
    pub fn restart(&mut self) {
        self.partial.clear();
    }
}

/// The log as text, by the table in the ELF of the image.
#[cfg(feature = "log")]
pub mod text {
    use super::Frames;
    use crate::Error;
    use crate::rig::Rig;
    use defmt_decoder::{DecodeError, Table};

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
        pub fn log(&mut self) -> Result<Vec<LogLine>, Error> {
            let frames = self.with(|stand| {
                stand.bench.log.drain(stand.bench.next_ns, stand.host);
                stand.bench.log.frames.clone()
            })?;
            let image = self.image();
            let table = Table::parse(&image.elf).map_err(|why| {
                Error::NotAnImage(image.path.clone(), format!("its defmt table cannot be read: {why}"))
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
}
