//! A simulated fingertip behind a port, for any client of the bus: paced to the clock, and idle between frames.
//!
//! Clients connect to a [`Port`]: a pseudo-terminal or a TCP port. [`serve`] advances a [`Finger`] with the clock,
//! passes received bytes to it, and sends its answers. One thread does all: it sleeps until a byte arrives, an answer
//! is due, or a [`TICK`] is over. [`Pace`] measures real-time operation and answer times.

#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

#[cfg(feature = "native")]
mod native;
mod port;

pub use port::{Event, Place, Port, Stop};

use output::say;
use std::time::{Duration, Instant};

/// Interval at which an idle finger is advanced: the time that it must catch up at most when a request arrives.
pub const TICK: Duration = Duration::from_millis(1);

pub trait Finger {
    type Error;

    fn now_s(&self) -> f64;

    /// Advances the finger to a time, or beyond it to the end of a step.
    fn run_until(&mut self, time_s: f64) -> Result<(), Self::Error>;

    /// Receives bytes of the host.
    fn hear(&mut self, bytes: &[u8]) -> Result<(), Self::Error>;

    /// Returns the bytes that the finger has sent by now.
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
    fn command(&mut self, _text: &str) -> Result<String, String> {
        Err("this finger takes no commands: `cargo xtask serve` without --board virtual does".into())
    }
}

/// Serves a finger until it is stopped. An answer counts as late after `late`, without its configured delay. With
/// `always` the real-time ratio is reported also while it is 1.
pub fn serve<F: Finger>(finger: &mut F, port: &mut Port, late: Duration, always: bool) -> Result<Served, F::Error> {
    let mut pace = Pace::new(finger.now_s(), late, always);
    let mut due = Instant::now() + TICK;
    loop {
        let now_s = pace.clock_s(finger.now_s());
        let wait = finger.due_s().map_or(due, |due_s| pace.until(due_s).min(due));
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
        if let Some(text) = pace.tell() {
            say::aside(text);
        }
    }
    Ok(pace.end())
}

/// Advances with the clock by at most a tick, as a request may arrive in between.
fn advance<F: Finger>(finger: &mut F, pace: &mut Pace) -> Result<(), F::Error> {
    let (now_s, clock_s) = (finger.now_s(), pace.clock_s(finger.now_s()));
    if clock_s > now_s { finger.run_until(clock_s.min(now_s + 2.0 * TICK.as_secs_f64())) } else { Ok(()) }
}

/// A finger that is farther behind does not try to catch up.
const BEHIND_MAX_S: f64 = 0.1;
/// Share of real time below which a finger is reported to be behind.
const KEEPS_UP: f64 = 0.98;
/// Interval of the checks and of their reports.
const LOOK: Duration = Duration::from_secs(5);

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Served {
    pub virtual_s: f64,
    pub wall_s: f64,
    pub received: u64,
    pub sent: u64,
    /// Answers, and how many of them were late.
    pub answers: u64,
    pub late: u64,
    /// The longest time between a request and its answer, less the answer's own delay.
    pub longest_s: f64,
}

pub struct Pace {
    begun: Instant,
    /// Time that a finger that keeps up had at `begun`, s; less by what was skipped because it was too far behind.
    begun_s: f64,
    /// Time of the finger, s, when it was asked last.
    now_s: f64,
    late: Duration,
    always: bool,
    asked: Option<Instant>,
    all: Served,
    /// Instant, virtual time and number of late answers at the last check.
    looked: (Instant, f64, u64),
}

impl Pace {
    pub fn new(begun_s: f64, late: Duration, always: bool) -> Self {
        let begun = Instant::now();
        Self {
            begun,
            begun_s,
            now_s: begun_s,
            late,
            always,
            asked: None,
            all: Served::default(),
            looked: (begun, 0.0, 0),
        }
    }

    /// Time of a finger that keeps up, s.
    pub fn clock_s(&mut self, now_s: f64) -> f64 {
        // The clock of a finger whose power was cut begins again: it counts on from there.
        self.all.virtual_s += (now_s - self.now_s).max(0.0);
        self.now_s = now_s;
        let clock_s = self.begun_s + self.begun.elapsed().as_secs_f64();
        let beyond_s = (clock_s - now_s - BEHIND_MAX_S).max(0.0);
        self.begun_s -= beyond_s;
        clock_s - beyond_s
    }

    /// Instant at which the clock reaches a time of the finger.
    pub fn until(&self, time_s: f64) -> Instant {
        self.begun + Duration::from_secs_f64((time_s - self.begun_s).max(0.0))
    }

    pub fn asked(&mut self, bytes: usize) {
        self.all.received += bytes as u64;
        self.asked = Some(Instant::now());
    }

    pub fn answered(&mut self, bytes: usize) {
        self.all.sent += bytes as u64;
        // An answer in pieces counts by its first piece.
        let Some(asked) = self.asked.take() else { return };
        self.all.answers += 1;
        let took = asked.elapsed();
        self.all.longest_s = self.all.longest_s.max(took.as_secs_f64());
        self.all.late += u64::from(took > self.late);
    }

    /// Returns the report on the time since the last check, if one is due.
    pub fn tell(&mut self) -> Option<String> {
        let (at, virtual_s, late) = self.looked;
        let wall_s = at.elapsed();
        if wall_s < LOOK {
            return None;
        }
        self.looked = (Instant::now(), self.all.virtual_s, self.all.late);
        let (ratio, late) = ((self.all.virtual_s - virtual_s) / wall_s.as_secs_f64(), self.all.late - late);
        let mut text = format!("pace     {ratio:.2} of real time");
        if late > 0 {
            let [allowed_ms, longest_ms] = [self.late.as_secs_f64(), self.all.longest_s].map(|s| s * 1e3);
            text +=
                &format!("; {late} answers later than {allowed_ms:.1} ms, the longest so far took {longest_ms:.1} ms");
        }
        (self.always || ratio < KEEPS_UP || late > 0).then_some(text)
    }

    pub fn end(&self) -> Served {
        Served { wall_s: self.begun.elapsed().as_secs_f64(), ..self.all }
    }
}

impl Served {
    pub fn text(&self) -> String {
        let Self { virtual_s, wall_s, received, sent, answers, late, longest_s } = self;
        format!(
            "served   {virtual_s:.1} s of virtual time in {wall_s:.1} s: {:.2} of real time\n         \
             {received} bytes in, {sent} out, {answers} answers, {late} of them late, the longest after {:.1} ms",
            virtual_s / wall_s,
            longest_s * 1e3
        )
    }
}
