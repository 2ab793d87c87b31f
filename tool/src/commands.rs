//! The commands, one module each.

pub mod calibrate;
pub mod capture;
pub mod device;
mod guided;
pub mod params;
pub mod press;
pub mod record;
pub mod share;
pub mod stop;
pub mod stream;
pub mod view;

use crate::client::Pong;
use crate::{Client, Error, table};
use fingertip::link::packet::BROADCAST;
use fingertip::measure::MeasureState;
use fingertip::shipped::address;
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::io::{self, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// True once output was lost against the user's will.
static LOST: AtomicBool = AtomicBool::new(false);

/// Advice after a tare during which something touched.
const TOUCHED: &str = "something seemed to touch the tip while it was tared: forces read too low by that. \
                       Free the tip and tare again";

/// Prints a line; [`said`] reports whether that worked.
pub fn say(text: impl std::fmt::Display) {
    note(writeln!(io::stdout(), "{text}"));
}

/// A closed pipe is not an error: the reader has seen enough. Any other failure (a full disk, say) is reported at exit.
fn note(written: io::Result<()>) {
    if written.is_err_and(|why| why.kind() != io::ErrorKind::BrokenPipe) {
        LOST.store(true, Ordering::Relaxed);
    }
}

/// True if all that was said is written.
pub fn said() -> Result<(), Error> {
    note(io::stdout().flush());
    if LOST.load(Ordering::Relaxed) { Err("the output cannot be written: is the disk full?".into()) } else { Ok(()) }
}

/// Says a line beside the results.
pub fn aside(text: impl std::fmt::Display) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Says beside the results how far it is, for people only.
fn report(text: impl std::fmt::Display, json: bool) {
    if !json {
        aside(text);
    }
}

/// Answers of a command for several IDs, until they are printed as one array. With `None` each is printed at once.
static ANSWERS: Mutex<Option<Vec<Value>>> = Mutex::new(None);

fn answers() -> MutexGuard<'static, Option<Vec<Value>>> {
    ANSWERS.lock().unwrap_or_else(PoisonError::into_inner)
}

fn say_json(value: &Value) {
    match &mut *answers() {
        Some(answers) => answers.push(value.clone()),
        None => say(format_args!("{value:#}")),
    }
}

/// Says an answer, for scripts or for people.
fn answer(json: bool, value: &Value, text: impl std::fmt::Display) {
    if json { say_json(value) } else { say(text) }
}

/// Runs a command for each of these IDs, or for all fingertips, also after an error of one. Before that, all of them get the
/// values `first`, in one packet each, which no absent ID delays. The answers of several in JSON are one array, also if there
/// are none.
pub fn each(
    client: &mut Client,
    ids: &[u8],
    json: bool,
    titled: bool,
    first: &[(u16, i64)],
    command: impl Fn(&mut Client) -> Result<(), Error>,
) -> Result<(), Error> {
    let (all, mut ids) = (ids.contains(&BROADCAST), ids.to_vec());
    if all {
        let (fingers, others): (Vec<_>, Vec<_>) = client.ping_all()?.into_iter().partition(Pong::is_fingertip);
        others
            .iter()
            .for_each(|pong| aside(format_args!("ID {} is no fingertip: nothing more is done with it", pong.id)));
        if fingers.is_empty() {
            return Err("no fingertip answers: is it powered, and is the baud rate right?".into());
        }
        ids = fingers.iter().map(|pong| pong.id).collect();
    }
    first.iter().try_for_each(|(register, value)| client.set_each(&ids, *register, *value))?;
    if let ([id], false) = (&ids[..], all) {
        client.id = *id;
        return command(client);
    }
    *answers() = json.then(Vec::new);
    let mut failed = Vec::new();
    for id in ids {
        client.id = id;
        if titled && !json {
            say(format_args!("ID {id}:"));
        }
        if let Err(why) = command(client) {
            failed.push(format!("ID {id}: {why}"));
        }
    }
    let all = answers().take();
    all.into_iter().for_each(|all| say_json(&Value::Array(all)));
    if failed.is_empty() { Ok(()) } else { Err(failed.join("; ").into()) }
}

/// Longest time for which a pause does not check for Ctrl-C.
const INTERRUPT_EVERY: Duration = Duration::from_millis(50);

/// Set by Ctrl-C, SIGTERM and SIGHUP (the end of a terminal).
#[derive(Clone, Debug)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Catches the signals: from now on they do not end the program by themselves. Under `nohup`, SIGHUP stays ignored.
    pub fn catch() -> Result<Self, Error> {
        let flag = Arc::new(AtomicBool::new(false));
        // SIGINT is also ignored in background jobs of a script, but a finger that moves must stop after Ctrl-C.
        let signals = [Some(SIGINT), Some(SIGTERM), (!ignores_hangup()).then_some(SIGHUP)];
        for signal in signals.into_iter().flatten() {
            signal_hook::flag::register(signal, flag.clone())
                .map_err(|why| format!("cannot wait for Ctrl-C: {why}"))?;
        }
        Ok(Self(flag))
    }

    /// True if it is time to end.
    pub fn came(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Fails once a signal came: for commands that a signal cuts short.
    pub fn check(&self) -> Result<(), Error> {
        if self.came() { Err(Error::Interrupted) } else { Ok(()) }
    }

    /// Waits until then, or until it is time to end.
    pub fn pause(&self, until: Instant) {
        while !self.came()
            && let Some(left) = until.checked_duration_since(Instant::now())
        {
            std::thread::sleep(left.min(INTERRUPT_EVERY));
        }
    }
}

/// True if this program was started with SIGHUP ignored. False on systems without `/proc`.
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (SIGHUP - 1) & 1 == 1)
}

/// Reads a register until it is as wanted, or the time is over. The last number.
fn wait_for(client: &mut Client, address: u16, within: Duration, wanted: impl Fn(i64) -> bool) -> Result<i64, Error> {
    let until = Instant::now() + within;
    loop {
        let number = client.again(|client| client.number(address))?;
        if wanted(number) || Instant::now() >= until {
            return Ok(number);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Fails in a fault, while a measuring motion runs, which a tare would end, and with torque on.
fn at_rest(client: &mut Client) -> Result<(), Error> {
    no_fault(client)?;
    if client.number(address::MEASURE_STATE)? == MeasureState::Running as i64 {
        return Err("another motion that measures is under way: wait for its end, or `fingertip stop`".into());
    }
    if client.number(address::TORQUE_ENABLE)? != 0 {
        return Err("torque is on: the tip may be pressing on something. Turn it off first: `fingertip stop`".into());
    }
    Ok(())
}

/// Fails if there is a fault, with the next step in the text.
fn no_fault(client: &mut Client) -> Result<(), Error> {
    let fault = client.number(address::FAULT)?;
    if fault == 0 { Ok(()) } else { Err(stopped(fault)) }
}

fn stopped(fault: i64) -> Error {
    let words = table::meaning(address::FAULT, fault);
    format!("the motor was stopped by fault {fault} ({words}): mend what caused it, then `fingertip recover`").into()
}
