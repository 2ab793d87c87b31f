//! A simulated fingertip behind a port, for any client of the bus: paced to the clock, and idle between frames.
//!
//! [`Port`] is where clients come in: a pseudo-terminal or a TCP port. [`serve`] moves a [`Finger`] on with the clock,
//! hands it what comes in, and sends what it answers. One thread does all: it sleeps until a byte comes in, an
//! answer is due, or a [`TICK`] is over. [`Pace`] counts what is promised: real time, and answers in time.

#[cfg(feature = "native")]
pub mod native;
mod pace;
mod port;

pub use pace::{Pace, Served};
pub use port::{Place, Port, Stop};

use output::say;
use port::Event;
use std::time::{Duration, Instant};

/// Interval at which an idle finger is moved on: what it has to catch up when a request comes.
pub const TICK: Duration = Duration::from_millis(1);

/// A simulated finger.
pub trait Finger {
    /// Why it cannot go on.
    type Error;

    /// Its own time, s.
    fn now_s(&self) -> f64;

    /// Goes on to a time of its own, or as far beyond as its steps take it.
    ///
    /// # Errors
    /// It cannot.
    fn run_until(&mut self, time_s: f64) -> Result<(), Self::Error>;

    /// Takes what the host sends.
    ///
    /// # Errors
    /// It cannot.
    fn hear(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;

    /// Returns the bytes that it sends by now.
    ///
    /// # Errors
    /// It cannot.
    fn answer(&mut self) -> Result<Vec<u8>, Self::Error>;

    /// When it has something to send, where that is known beforehand.
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
    /// It cannot be understood or done.
    fn command(&mut self, text: &str) -> Result<String, String>;
}

/// Serves a finger until somebody stops it. `late` is after which time an answer counts as late, its own delay left
/// out; `always` says how it keeps pace also where it does.
///
/// # Errors
/// The finger cannot go on.
pub fn serve<F: Finger>(finger: &mut F, port: &mut Port, late: Duration, always: bool) -> Result<Served, F::Error> {
    let mut pace = Pace::new(finger.now_s(), late, always);
    let mut due = Instant::now() + TICK;
    loop {
        let now_s = pace.clock_s(finger.now_s());
        let wait = pace.until(finger.due_s()).map_or(due, |answer| answer.min(due));
        // One that is behind goes on at once.
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

/// Goes on with the clock, a tick at most: in between somebody may ask.
fn advance<F: Finger>(finger: &mut F, pace: &mut Pace) -> Result<(), F::Error> {
    let (now_s, clock_s) = (finger.now_s(), pace.clock_s(finger.now_s()));
    if clock_s > now_s { finger.run_until(clock_s.min(now_s + 2.0 * TICK.as_secs_f64())) } else { Ok(()) }
}
