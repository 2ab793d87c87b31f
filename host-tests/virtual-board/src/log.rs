//! The image's log: defmt frames out of the RTT buffer, taken out while it runs as a probe does.

use crate::image::Firmware;
use rigless::emulator::Host;
use rigless::soc::Width;

/// Offsets in the RTT control block: the first up-channel's buffer, size, write and read position.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITTEN: u64 = 36;
const READ: u64 = 40;

/// Reads the log out, and counts its messages.
#[derive(Debug, Default)]
pub struct Log {
    block: Option<u64>,
    /// Number of messages: each ends with a zero byte, and no other byte of it is zero.
    pub messages: usize,
}

impl Log {
    /// Log of an image; stays empty for an image without a log.
    pub fn new(image: &Firmware) -> Self {
        Self { block: image.symbol("_SEGGER_RTT"), ..Self::default() }
    }

    /// Reads the log buffer; does nothing until the image has set it up.
    pub fn drain(&mut self, host: &mut dyn Host) {
        let Some(block) = self.block else { return };
        let mut word = |offset| host.read(block + offset, Width::W32).unwrap_or(0);
        let (buffer, size, written, mut read) = (word(BUFFER), word(SIZE), word(WRITTEN), word(READ));
        if buffer == 0 || written == read || written >= size || read >= size {
            return;
        }
        while read != written {
            self.messages += usize::from(host.read(buffer + read, Width::W8).ok() == Some(0));
            read = (read + 1) % size;
        }
        // If this fails, the log is read again.
        let _ = host.write(block + READ, Width::W32, read);
    }
}
