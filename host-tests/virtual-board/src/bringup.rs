//! The image of `cargo xtask bringup` on the emulated board, listened to as on a NUCLEO's virtual COM port.

use crate::board::Surroundings;
use crate::image::hex;
use crate::{Error, Options, Rig};
use bringup::judge::{self, Board, Judgement};
use sim::plant::Setup;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::path::Path;

/// Virtual time without a line of output after which the image counts as stuck, ms.
const SILENT_MS: u64 = 60_000;

/// Runs the image to the end of its report and judges that.
pub fn run(image: &Path, options: &judge::Options) -> Result<(Judgement, Rig), Error> {
    let mut rig = Rig::new(image, Surroundings::plant(&Setup::default()), &Options::default())?;
    let sha256 = hex(&rigless::snapshot::digest(&rig.flashed()?));
    let mut port = Port { rig, heard: VecDeque::new() };
    let judgement = options.judge(&mut port, Board::Emulated, sha256)?;
    Ok((judgement, port.rig))
}

/// The far end of the port; to read runs the board.
struct Port {
    rig: Rig,
    heard: VecDeque<u8>,
}

impl Read for Port {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        for _ in 0..SILENT_MS {
            if !self.heard.is_empty() {
                return self.heard.read(bytes);
            }
            self.rig.run_ms(1).map_err(io::Error::other)?;
            let received = self.rig.take_received().map_err(io::Error::other)?;
            self.heard.extend(received.iter().map(|timed| timed.byte));
        }
        Err(io::ErrorKind::TimedOut.into())
    }
}

impl Write for Port {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.rig.send(bytes).map_err(io::Error::other)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
