//! The image of `cargo xtask bringup` on the emulated board, listened to as on a NUCLEO's virtual COM port.

use crate::image::Flashable;
use crate::{Error, Options, Rig};
use bringup::judge::{Board, Judgement, judge};
use bringup::listen::listen;
use sim::plant::{Plant, Setup};
use std::collections::{HashMap, VecDeque};
use std::io::{self, Read, Write};
use std::path::Path;

/// Virtual time without a line of output after which the image counts as stuck, ms.
const SILENT_MS: u64 = 60_000;

/// Runs the image to the end of its report and judges that.
pub fn run(
    image: &Path,
    options: &Options,
    frames: u32,
    estimates: &HashMap<String, f64>,
    progress: &mut dyn FnMut(&str),
) -> Result<(Judgement, Rig), Error> {
    let mut rig = Rig::new(image, Plant::new(&Setup::default()), options)?;
    let flash = Flashable::of(rig.image())?;
    flash.check_loaded(&mut rig)?;
    let report = listen(&mut Port { rig: &mut rig, heard: VecDeque::new() }, frames, progress)?;
    Ok((judge(&report, Board::Emulated, flash.sha256(), estimates), rig))
}

/// The far end of the port; to read runs the board.
struct Port<'a> {
    rig: &'a mut Rig,
    heard: VecDeque<u8>,
}

impl Read for Port<'_> {
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

impl Write for Port<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.rig.send(bytes).map_err(io::Error::other)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
