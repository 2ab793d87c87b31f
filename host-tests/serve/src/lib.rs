//! A simulated fingertip behind a port, for any client of the bus: paced to the clock, and idle between frames.
//!
//! Clients connect to a [`Port`]: a pseudo-terminal or a TCP port. [`serve`] advances a [`Finger`] with the clock,
//! passes received bytes to it, and sends its answers. One thread does all: it sleeps until a byte arrives, an answer
//! is due, or a [`TICK`] is over. [`Pace`] measures real-time operation and answer times.

#[cfg(feature = "native")]
pub mod native;
mod pace;
mod port;

pub use pace::{Pace, Served};
pub use port::{Place, Port, Stop};

use output::say;
use port::Event;
use std::time::{Duration, Instant};

/// Interval at which an idle finger is advanced: the time that it must catch up at most when a request arrives.
pub const TICK: Duration = Duration::from_millis(1);

/// A simulated finger.
pub trait Finger {
    /// Reason of a failure.
    type Error;

    /// Time of the finger, s.
    fn now_s(&self) -> f64;

    /// Advances the finger to a time, or beyond it to the end of a step.
    ///
    /// # Errors
    /// The simulation failed.
    fn run_until(&mut self, time_s: f64) -> Result<(), Self::Error>;

    /// Receives bytes of the host.
    ///
    /// # Errors
    /// The simulation failed.
    fn hear(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;

    /// Returns the bytes that the finger has sent by now.
    ///
    /// # Errors
    /// The simulation failed.
    fn answer(&mut self) -> Result<Vec<u8>, Self::Error>;

    /// Time of the next answer, s, if it is known beforehand.
    fn due_s(&self) -> Option<f64> {
        None
    }

    /// The bus speed that it listens at; none hears any.
    fn baud(&self) -> Option<u32> {
        None
    }

    /// Executes a command from the standard input, and returns what was done.
    ///
    /// # Errors
    /// The command is unknown or cannot be executed.
    fn command(&mut self, text: &str) -> Result<String, String>;
}

/// Serves a finger until it is stopped. An answer counts as late after `late`, without its configured delay. With
/// `always` the real-time ratio is reported also while it is 1.
///
/// # Errors
/// The simulation failed.
pub fn serve<F: Finger>(finger: &mut F, port: &mut Port, late: Duration, always: bool) -> Result<Served, F::Error> {
    let mut pace = Pace::new(finger.now_s(), late, always);
    let mut due = Instant::now() + TICK;
    loop {
        let now_s = pace.clock_s(finger.now_s());
        let wait = pace.until(finger.due_s()).map_or(due, |answer| answer.min(due));
        // A finger that is behind continues at once.
        let behind = now_s - finger.now_s() > TICK.as_secs_f64();
        let wait = if behind { Duration::ZERO } else { wait.saturating_duration_since(Instant::now()) };
        match port.wait(wait, finger.baud()) {
            Event::Bytes(bytes) => {
                advance(finger, &mut pace)?;
                pace.asked(bytes.len());
                finger.hear(&bytes)?;
            }
            Event::Command(text) => match finger.command(&text) {
                Ok(done) if done.is_empty() => {}
                Ok(done) => say::line(done),
                Err(why) => say::aside(why),
            },
            Event::Stop => break,
            Event::Nothing => {}
        }
        if Instant::now() >= due {
            due = Instant::now() + TICK;
        }
        advance(finger, &mut pace)?;
        let answer = finger.answer()?;
        if !answer.is_empty() {
            port.send(&answer);
            pace.answered(answer.len());
        }
        if let Some(text) = pace.tell(finger.now_s()) {
            say::aside(text);
        }
    }
    Ok(pace.end(finger.now_s()))
}

/// Advances with the clock by at most a tick, as a request may arrive in between.
fn advance<F: Finger>(finger: &mut F, pace: &mut Pace) -> Result<(), F::Error> {
    let (now_s, clock_s) = (finger.now_s(), pace.clock_s(finger.now_s()));
    if clock_s > now_s { finger.run_until(clock_s.min(now_s + 2.0 * TICK.as_secs_f64())) } else { Ok(()) }
}
