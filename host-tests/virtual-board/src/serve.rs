//! The board kept alive for any client of the bus: behind a pseudo-terminal or a TCP port, no faster than real time.

mod port;

pub use port::{Place, Port};

use crate::{Error, Rig};
use port::Event;
use std::sync::mpsc::{RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

/// Virtual time between two looks at the port.
const TICK: Duration = Duration::from_millis(1);
/// A board that is farther behind does not try to catch up.
const BEHIND_MAX: Duration = Duration::from_millis(100);

/// Stops the board from another thread.
#[derive(Clone, Debug)]
pub struct Stop(Sender<Event>);

impl Stop {
    /// The board stops at its next look at the port; one that has stopped already does nothing.
    pub fn stop(&self) {
        let _ = self.0.send(Event::Stop);
    }
}

/// What a board did while it was served.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Served {
    /// Virtual time.
    pub virtual_s: f64,
    /// Real time.
    pub wall_s: f64,
    /// Bytes from clients.
    pub received: u64,
    /// Bytes to them.
    pub sent: u64,
}

/// Runs the board until it is stopped.
///
/// # Errors
/// The emulator stopped.
pub fn serve(rig: &mut Rig, port: &mut Port) -> Result<Served, Error> {
    let (begun, begun_ns) = (Instant::now(), rig.now_ns());
    let (mut received, mut sent) = (0, 0);
    let mut due = begun;
    loop {
        match port.next(due.saturating_duration_since(Instant::now())) {
            Ok(Event::Bytes(bytes)) => {
                received += bytes.len() as u64;
                rig.send(&bytes)?;
                continue;
            }
            Ok(Event::Client(client)) => {
                port.attach(client);
                continue;
            }
            Ok(Event::Stop) | Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {}
        }
        rig.run_until_ns(rig.now_ns() + TICK.as_nanos() as u64)?;
        let bytes: Vec<u8> = rig.take_received()?.iter().map(|timed| timed.byte).collect();
        sent += bytes.len() as u64;
        // A client that went away does not stop the board.
        let _ = port.write_all(&bytes);
        due = (due + TICK).max(Instant::now().checked_sub(BEHIND_MAX).unwrap_or(due));
    }
    let virtual_s = (rig.now_ns() - begun_ns) as f64 * 1e-9;
    Ok(Served { virtual_s, wall_s: begun.elapsed().as_secs_f64(), received, sent })
}
