//! The image's log: defmt frames out of the RTT buffer, taken out while it runs as a probe does.

use crate::image::Firmware;
use rigless::emulator::Host;
use rigless::soc::Width;

/// Offsets in the RTT control block: the first up-channel's buffer, size, write and read position.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITTEN: u64 = 36;
const READ: u64 = 40;

/// Reads the log out. [`text`] makes lines of it.
#[derive(Debug, Default)]
pub struct Log {
    block: Option<u64>,
    /// Bytes received since the last whole frame.
    partial: Vec<u8>,
    /// Whole frames, still encoded, each ended by a zero; and the virtual time at which they were read, ns.
    pub frames: Vec<(u64, Vec<u8>)>,
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
        self.frames.push((at_ns, self.partial.drain(..=end).collect()));
    }

    /// Drops a half-written line: the image restarts.
    pub fn restart(&mut self) {
        self.partial.clear();
    }
}

/// The log as text, by the table in the ELF of the image.
#[cfg(feature = "log")]
pub mod text {
    use crate::Error;
    use crate::rig::Rig;
    use defmt_decoder::{DecodeError, Table};

    impl Rig {
        /// The image's log so far: the instant at which a line was read, ns, and its level, time and text.
        pub fn log(&mut self) -> Result<Vec<(u64, String)>, Error> {
            let frames = self.with(|stand| {
                stand.bench.log.drain(stand.bench.next_ns, stand.host);
                stand.bench.log.frames.clone()
            })?;
            let image = self.image();
            let table = Table::parse(&image.elf).map_err(|why| {
                Error::NotAnImage(image.path.clone(), format!("its defmt table cannot be read: {why}"))
            })?;
            let Some(table) = table else { return Ok(Vec::new()) };
            let mut lines = Vec::new();
            for (at_ns, bytes) in &frames {
                lines.extend(decode(&table, bytes).map(|line| (*at_ns, line)));
            }
            Ok(lines)
        }
    }

    fn decode(table: &Table, bytes: &[u8]) -> impl Iterator<Item = String> {
        let mut decoder = table.new_stream_decoder();
        decoder.received(bytes);
        std::iter::from_fn(move || match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map_or("", |level| level.as_str());
                let time = frame.display_timestamp().map(|time| time.to_string()).unwrap_or_default();
                Some(format!("{level} {time} {}", frame.display_message()))
            }
            Err(DecodeError::UnexpectedEof) => None,
            Err(DecodeError::Malformed) => Some("a damaged frame of the log".to_owned()),
        })
    }
}
