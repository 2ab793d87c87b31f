//! Common parts of the guided procedures (`commission`, `identify`, `calibrate`).

pub(super) mod hold;
pub(super) mod motion;
mod result;

use super::params::{self, file};
use super::{Interrupt, aside};
use crate::{Client, Error, numbers, whole};
use fingertip::params::Params;
use fingertip::shipped::address;
use result::Found;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// Options of every guided procedure.
#[derive(Debug, clap::Args)]
pub struct Options {
    /// Folder that keeps each record and step; the same folder resumes the procedure
    #[arg(long, value_name = "DIR")]
    session: Option<PathBuf>,
    /// Write the parameters without asking
    #[arg(long)]
    apply: bool,
    /// Keep the parameters over a reset, once they are written
    #[arg(long)]
    save: bool,
    /// Longest time for one motion
    #[arg(long, default_value_t = 120.0, value_parser = numbers::seconds)]
    within_s: f64,
}

/// Options of the presses.
#[derive(Debug, clap::Args)]
pub struct Presses {
    /// Pause in the air before each tare: creep of the press before would shift the zeros
    #[arg(long, default_value_t = 10.0, value_parser = numbers::seconds)]
    pub(super) pause_s: f64,
    /// Do not ask for Enter before a press
    #[arg(long)]
    pub(super) no_wait: bool,
}

impl Presses {
    /// Refuses questions that `--json` cannot ask.
    pub(super) fn check(&self, json: bool) -> Result<(), Error> {
        if !json || self.no_wait {
            return Ok(());
        }
        let why = "--json asks no questions: give --no-wait, with plate and finger in place";
        Err(Error::NotUnderstood(why.into()))
    }
}

/// A procedure under way: what it may do, the controller, what is kept of it and what it found.
pub(super) struct Procedure<'a> {
    pub run: Run<'a>,
    pub client: &'a mut Client,
    pub session: Session,
    pub found: Found,
}

impl<'a> Procedure<'a> {
    /// Catches signals from here on, and begins or resumes the session.
    pub(super) fn begin(
        command: &'static str,
        options: &'a Options,
        json: bool,
        client: &'a mut Client,
    ) -> Result<Self, Error> {
        let run = Run { options, interrupt: Interrupt::catch()?, json };
        let session = Session::open(options.session.as_deref(), command, client)?;
        result::same_settings(&session, client)?;
        Ok(Self { run, client, session, found: Found::default() })
    }
}

/// How a procedure runs: its options, and the way to the person at the terminal.
pub(super) struct Run<'a> {
    options: &'a Options,
    interrupt: Interrupt,
    json: bool,
}

/// Time without a look at the signals, ns.
const POLL_NS: i64 = 50_000_000;
/// Wrong answers to one question after which the procedure ends.
const TRIES: u32 = 3;

impl Run<'_> {
    pub fn report(&self, text: impl std::fmt::Display) {
        if !self.json {
            aside(text);
        }
    }

    /// Asks until the answer can be parsed, three times at most. `idle` runs every 50 ms meanwhile. `option` gives the answer
    /// without a question, which `--json` demands.
    fn parsed<T>(
        &self,
        question: &str,
        option: &str,
        parse: impl Fn(&str) -> Result<T, String>,
        idle: &mut dyn FnMut() -> Result<(), Error>,
    ) -> Result<T, Error> {
        if self.json {
            return Err(Error::NotUnderstood(format!("--json asks no questions: give {option} (\"{question}\")")));
        }
        let mut why = String::new();
        for _ in 0..TRIES {
            aside(question);
            let line = self.line(option, idle)?;
            match parse(line.trim()) {
                Ok(answer) => return Ok(answer),
                Err(wrong) => why = format!("`{}`: {wrong}", line.trim()),
            }
            aside(&why);
        }
        Err(format!("{why}. {TRIES} answers to \"{question}\" were not understood; {option} gives the answer").into())
    }

    pub fn yes(&self, question: &str, option: &str) -> Result<bool, Error> {
        self.parsed(&format!("{question} [yes/no]"), option, yes_or_no, &mut || Ok(()))
    }

    pub fn enter(&self, question: &str, option: &str) -> Result<(), Error> {
        self.parsed(&format!("{question}; then press Enter"), option, |_| Ok(()), &mut || Ok(()))
    }

    fn line(&self, option: &str, idle: &mut dyn FnMut() -> Result<(), Error>) -> Result<String, Error> {
        let input = io::stdin();
        let wait = Timespec { tv_sec: 0, tv_nsec: POLL_NS };
        loop {
            self.interrupt.check()?;
            idle()?;
            match poll(&mut [PollFd::new(&input, PollFlags::IN)], Some(&wait)) {
                Ok(0) | Err(rustix::io::Errno::INTR) => continue,
                Ok(_) => {}
                Err(why) => return Err(format!("cannot read an answer: {why}").into()),
            }
            let line = unbuffered_line().map_err(|why| format!("cannot read an answer: {why}"))?;
            return line.ok_or_else(|| format!("nobody answers: give {option}").into());
        }
    }
}

/// A line of the standard input; none at its end. Bytes behind the line stay for the next question.
fn unbuffered_line() -> io::Result<Option<String>> {
    let (mut line, mut byte) = (Vec::new(), [0]);
    loop {
        match rustix::io::read(io::stdin(), &mut byte) {
            Ok(0) if line.is_empty() => return Ok(None),
            Ok(0) => break,
            Ok(_) if byte == *b"\n" => break,
            Ok(_) => line.extend(byte),
            Err(rustix::io::Errno::INTR) => {}
            Err(why) => return Err(why.into()),
        }
    }
    Ok(Some(String::from_utf8_lossy(&line).into_owned()))
}

pub fn yes_or_no(text: &str) -> Result<bool, String> {
    match text.to_lowercase().as_str() {
        "y" | "yes" => Ok(true),
        "n" | "no" => Ok(false),
        _ => Err("yes or no is expected".into()),
    }
}

// A session: parameters and gains before it, and the steps that are done. With a folder it outlives the program.
//
// | file | content |
// | --- | --- |
// | `session.json` | command, device, parameters and gains before, and the steps by name |
// | `press-1.fts`, `strokes.fts` | a motion's record, byte for byte as the controller delivered it |
//
// A file is written beside its place and renamed once it is whole. A record is listed in `session.json` after it was
// written: a kill between the two repeats the motion.

const VERSION: u64 = 1;

/// Parameters and gains of the controller at one time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    pub params: Params,
    /// Gains in 1/16384, row by row.
    pub gains: Vec<Vec<u16>>,
}

impl Settings {
    fn read(client: &mut Client) -> Result<Self, Error> {
        let bytes = client.again(|client| client.read(address::PARAMS, 4 * Params::COUNT as u16))?;
        Ok(Self { params: params::of_bytes(&bytes), gains: file::read_gains(client)? })
    }

    fn get(&self, name: &str) -> Option<i32> {
        let index = Params::RANGES.iter().position(|(known, ..)| *known == name)?;
        self.params.to_array().get(index).copied()
    }

    fn json(&self) -> Value {
        json!({ "params": params::named(&self.params), "gains": self.gains })
    }

    fn of(value: &Value) -> Option<Self> {
        let mut values = [0; Params::COUNT];
        for (value_, (name, ..)) in values.iter_mut().zip(Params::RANGES) {
            *value_ = value["params"][name].as_i64()?.try_into().ok()?;
        }
        let row = |row: &Value| -> Option<Vec<u16>> {
            row.as_array()?.iter().map(|gain| gain.as_u64()?.try_into().ok()).collect()
        };
        let gains = value["gains"].as_array()?.iter().map(row).collect::<Option<_>>()?;
        Some(Self { params: Params::from_array(&values), gains })
    }
}

/// What is kept of a procedure.
#[derive(Debug)]
pub(super) struct Session {
    folder: Option<PathBuf>,
    command: &'static str,
    id: u8,
    /// Settings with which all records were made.
    pub before: Settings,
    pub steps: Map<String, Value>,
    pub records: BTreeMap<String, Vec<u8>>,
}

impl Session {
    /// Begins a session, or resumes the one in the folder, which must be of the same command and device.
    fn open(folder: Option<&Path>, command: &'static str, client: &mut Client) -> Result<Self, Error> {
        let mut session = Self {
            folder: folder.map(Path::to_owned),
            command,
            id: client.id,
            before: Settings::read(client)?,
            steps: Map::new(),
            records: BTreeMap::new(),
        };
        let Some(folder) = folder else { return Ok(session) };
        fs::create_dir_all(folder).map_err(|why| Error::file("make the folder", folder, why))?;
        let file = folder.join("session.json");
        let text = match fs::read_to_string(&file) {
            Ok(text) => text,
            Err(why) if why.kind() == io::ErrorKind::NotFound => {
                session.keep()?;
                return Ok(session);
            }
            Err(why) => return Err(Error::file("read", &file, why)),
        };
        let not_one = |why: &str| Error::Other(format!("{}: {why}; name another folder", file.display()));
        let value: Value = serde_json::from_str(&text).map_err(|why| not_one(&why.to_string()))?;
        if value["version"].as_u64() != Some(VERSION) {
            return Err(not_one("not a session that this version knows"));
        }
        if value["command"] != command || value["id"] != client.id {
            let (command, id) = (&value["command"], &value["id"]);
            return Err(not_one(&format!("a session of the command {command} with ID {id}")));
        }
        session.before = Settings::of(&value["before"]).ok_or_else(|| not_one("the settings before are damaged"))?;
        session.steps = value["steps"].as_object().cloned().ok_or_else(|| not_one("the steps are damaged"))?;
        for name in session.steps.keys().filter(|name| name.ends_with(".fts")) {
            let file = folder.join(name);
            let bytes = fs::read(&file).map_err(|why| Error::file("read", &file, why))?;
            session.records.insert(name.clone(), bytes);
        }
        Ok(session)
    }

    /// Numbers of a step that is done; none of one that is not.
    fn numbers(&self, step: &str) -> &[Value] {
        self.steps.get(step).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default()
    }

    pub fn done(&mut self, name: &str, value: Value) -> Result<(), Error> {
        self.steps.insert(name.into(), value);
        self.keep()
    }

    pub fn recorded(&mut self, name: &str, bytes: Vec<u8>) -> Result<(), Error> {
        if let Some(folder) = &self.folder {
            whole::write(&folder.join(name), true, &bytes)?;
        }
        let length = bytes.len();
        self.records.insert(name.into(), bytes);
        self.done(name, json!({ "bytes": length }))
    }

    /// Forgets steps that begin with this, so that the next run repeats them.
    pub fn forget(&mut self, begin: &str) -> Result<(), Error> {
        self.steps.retain(|name, _| !name.starts_with(begin));
        self.records.retain(|name, _| !name.starts_with(begin));
        self.keep()
    }

    fn keep(&self) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let value = json!({
            "version": VERSION, "command": self.command, "id": self.id, "before": self.before.json(), "steps": self.steps,
        });
        whole::write(&folder.join("session.json"), true, &serde_json::to_vec_pretty(&value).unwrap_or_default())
    }
}
